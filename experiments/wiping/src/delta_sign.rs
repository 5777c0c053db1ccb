//! The sign of delta on the arm: where the adaptive law is stable, against the closed form.
//!
//! The closed form is for one axis. The arm is least stable in the direction in which it is heaviest, which is not an
//! axis: there the inertia is an eigenvalue of Lambda, while the law damps with Lambda's diagonal.

use std::f64::consts::TAU;
use std::path::Path;

use aforce::{
    ActionSpace, Controller, Damping, DeltaSign, JointVector, Measurement, OperationalSpace, Psi, Stiffness, Vector3,
    stability_margin,
};
use anyhow::Result;
use nalgebra::Matrix3;
use output::file;
use output::parallel;
use physics::scenes::wipe::Wipe;
use physics::{Deviation, Plant, Simulation};
use serde::Serialize;
use show::plot::{self, Panel, Series};

use crate::setup::Setup;
use crate::spaces::AFORCE;
use crate::trial::Trial;

/// Ways of damping, with their names.
pub const DAMPINGS: [(Damping, &str); 2] =
    [(Damping::MassAware, "D = 2 sqrt(K m)"), (Damping::Literal, "D = 2 sqrt(K), as printed")];
/// Signs, with their names.
pub const SIGNS: [(DeltaSign, &str); 3] =
    [(DeltaSign::Damping, "damping"), (DeltaSign::Off, "off"), (DeltaSign::Literal, "literal")];
/// Lowest stiffness (N/m) of the grid, and alpha as a multiple of the closed form's limit.
const STIFFNESS: [f64; 5] = [50.0, 100.0, 200.0, 400.0, 800.0];
const SHARES: [f64; 8] = [0.5, 0.71, 0.84, 0.92, 1.09, 1.19, 1.41, 2.0];
/// The push that sets the arm swinging: force in the heaviest direction (N) and duration (s). So small that feed-forward
/// and rates stay far from their bounds: beyond them an unstable law goes round in a limit cycle.
const PUSH: (f64, f64) = (0.01, 0.1);
/// The natural periods after the push whose largest deviations are compared.
const PERIODS: [usize; 2] = [2, 4];
/// Deviation (m), a hundred times that by the push, beyond which the arm counts as lost.
const LOST: f64 = 0.01;

/// One point of the grid.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Point {
    /// How D is formed.
    pub damping: &'static str,
    /// The sign of delta.
    pub sign: &'static str,
    /// K_min (N/m).
    pub stiffness_min: f64,
    /// Largest stable alpha by the closed form in the heaviest direction (N/m/s), the joints' damping included.
    pub alpha_max: f64,
    /// The same for the least stable of the three axes, each with its own entry of the inertia matrix.
    pub alpha_max_axes: f64,
    /// Feed-forward gain (N/m/s).
    pub alpha: f64,
    /// The same as a multiple of `alpha_max`.
    pub share: f64,
    /// Largest deviation in the fourth natural period, as a share of that in the second.
    pub growth: f64,
    /// Whether the law is stable on the arm: `growth` is below 1.
    pub stable: bool,
}

/// Holds the arm in the air under every law of the grid and pushes it.
///
/// # Errors
/// If a configuration is not allowed.
pub fn grid(setup: &Setup) -> Result<Vec<Point>> {
    let mut jobs = vec![];
    for damping in DAMPINGS {
        for sign in SIGNS {
            for stiffness in STIFFNESS {
                jobs.extend(SHARES.map(|share| (damping, sign, stiffness, share)));
            }
        }
    }
    parallel::map(&jobs, |&(damping, sign, stiffness, share)| point(setup, damping, sign, stiffness, share))
}

/// One law on the arm. Its alpha is the closed form's limit times `share`. Its stiffness along the axes is held at the
/// lowest value, where the law is least stable; about the axes it follows the law.
///
/// # Errors
/// If the configuration is not allowed.
pub fn point(
    setup: &Setup,
    damping: (Damping, &'static str),
    sign: (DeltaSign, &'static str),
    stiffness: f64,
    share: f64,
) -> Result<Point> {
    let robot = setup.arm();
    let (arm, joints) = (robot.arm, robot.damping());
    let Trial { height, friction, start, .. } = Trial::nominal();
    let plant = Plant { robot, dt: setup.controller.dt(), config: setup.simulation, deviation: Deviation::default() };
    let (mut simulation, _) = Wipe::simulate(&plant, height, friction);
    simulation.reset(&start);
    let y = simulation.measure();

    let first = setup.spaces[AFORCE].clone();
    let mut space = ActionSpace { damping: damping.0, force: false, commanded_psi: None, ..first };
    let mut psi = *space.psi().expect("the first space adapts");
    (psi.delta_sign, psi.allow_unstable) = (sign.0, true);
    for axis in 0..3 {
        psi.k_min.set(axis, stiffness);
        psi.k_0.set(axis, stiffness);
        psi.k_max.set(axis, stiffness);
        psi.alpha.set(axis + 3, 0.0);
    }
    let inertia = OperationalSpace::new(&y.mass, &y.jacobian).expect("a mass matrix").lambda_p;
    let principal = inertia.symmetric_eigen();
    let heaviest = principal.eigenvectors.column(principal.eigenvalues.imax()).into_owned();
    let limit = |direction: &Vector3| closed_form(&space, &psi, &y, &joints, direction);
    let alpha_max = limit(&heaviest);
    let axes = Matrix3::identity();
    let alpha_max_axes = axes.column_iter().map(|axis| limit(&axis.into_owned())).fold(f64::INFINITY, f64::min);
    let alpha = share * alpha_max;
    (0..3).for_each(|axis| psi.alpha.set(axis, alpha));
    space.stiffness = Stiffness::Adaptive(psi);

    let mut controller = Controller::new(&space, &setup.controller, &arm, Vector3::z_axis())?;
    controller.reset(&y);
    let period = TAU * (principal.eigenvalues.max() / stiffness).sqrt();
    let growth = growth(&mut simulation, &mut controller, &heaviest, period);
    Ok(Point {
        damping: damping.1,
        sign: sign.1,
        stiffness_min: stiffness,
        alpha_max,
        alpha_max_axes,
        alpha,
        share,
        growth,
        stable: growth < 1.0,
    })
}

/// Largest stable alpha (N/m/s) of the law `psi` with the damping of `space`, for motion in `direction`, a unit vector, in the
/// pose `y`; mu and delta are those of x, and `joints` is the damping of the joints (Nm s/rad).
fn closed_form(space: &ActionSpace, psi: &Psi, y: &Measurement, joints: &JointVector, direction: &Vector3) -> f64 {
    let arm = OperationalSpace::new(&y.mass, &y.jacobian).expect("a mass matrix");
    let of_axes = space.damping.of(psi.k_min.vector(), &arm.diagonal(), &space.damping_ratio);
    let own = direction.dot(&of_axes.fixed_rows::<3>(0).component_mul(direction));
    // Joint velocities of that motion, rotation left free: M^-1 J^T Lambda.
    let mass = y.mass.cholesky().expect("a mass matrix");
    let motion = mass.solve(&y.jacobian.fixed_rows::<3>(0).tr_mul(&(arm.lambda_p * direction)));
    let damping = own + motion.dot(&joints.component_mul(&motion));
    let inertia = direction.dot(&(arm.lambda_p * direction));
    stability_margin(psi, 0, inertia, damping).alpha_max
}

/// Largest deviation in the last of the [`PERIODS`] after a push in `direction`, as a share of that in the first of them.
fn growth(simulation: &mut Simulation, controller: &mut Controller, direction: &Vector3, period: f64) -> f64 {
    let [early, late] = PERIODS.map(|period| period - 1);
    let dt = simulation.dt();
    let mut peaks = [0.0f64; PERIODS[1]];
    for step in 0..((PUSH.1 + PERIODS[1] as f64 * period) / dt) as usize {
        let time = step as f64 * dt;
        let y = simulation.measure();
        let mut tau = controller.update(&y);
        let error = controller.error().fixed_rows::<3>(0).norm();
        if time < PUSH.1 {
            tau += y.jacobian.fixed_rows::<3>(0).tr_mul(&(PUSH.0 * direction));
        } else {
            let peak = &mut peaks[(((time - PUSH.1) / period) as usize).min(late)];
            *peak = peak.max(error);
        }
        if simulation.step(&tau, 0.0).is_err() || error > LOST {
            return f64::INFINITY;
        }
    }
    peaks[late] / peaks[early]
}

/// Writes `delta_sign.csv`, `delta_sign.svg`.
///
/// # Errors
/// If they cannot be written.
pub fn write(points: &[Point], out: &Path) -> Result<()> {
    file::write_table(&out.join("delta_sign.csv"), points)?;
    let panels: Vec<Panel> = DAMPINGS.iter().map(|(_, damping)| panel(points, damping)).collect();
    plot::write("The sign of delta", &panels, &out.join("delta_sign"))
}

fn panel(points: &[Point], damping: &str) -> Panel {
    let mut series = vec![];
    for (_, sign) in SIGNS {
        let label = format!("{sign}, closed form");
        let of_sign = points.iter().filter(|p| p.damping == damping && p.sign == sign && p.share == SHARES[0]);
        series.push(Series::new(label, of_sign.map(|p| (p.stiffness_min, p.alpha_max)).collect()));
    }
    for (_, sign) in SIGNS {
        for stiffness in STIFFNESS {
            let of = |p: &&Point| p.damping == damping && p.sign == sign && p.stiffness_min == stiffness;
            let line: Vec<&Point> = points.iter().filter(of).collect();
            // Between the last stable alpha and the first unstable one; no point if all are alike.
            let boundary = line.windows(2).find(|pair| pair[0].stable && !pair[1].stable);
            let point = boundary.map(|pair| (stiffness, (pair[0].alpha * pair[1].alpha).sqrt()));
            series.push(Series::new(format!("{sign}, on the arm"), point.into_iter().collect()));
        }
    }
    Panel {
        title: damping.into(),
        x_label: "K_min (N/m)".into(),
        y_label: "largest stable alpha (N/m/s)".into(),
        series,
        logarithmic: true,
        ..Panel::default()
    }
}
