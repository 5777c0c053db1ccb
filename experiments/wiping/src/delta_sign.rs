//! The sign of delta on the arm: where the adaptive law is stable, against the closed form for one axis.

use std::f64::consts::TAU;
use std::path::Path;

use aforce::{
    ActionSpace, AdaptiveImpedance, AxisLaw, Controller, ControllerConfig, Damping, DeltaSign, Impedance, JointVector,
    Measurement, OperationalSpace, TorqueLimits, Vector3, Wrench, stability_margin,
};
use anyhow::Result;
use output::plot::{self, Panel, Series};
use physics::scenes::wipe::Wipe;
use physics::{Plant, Simulation};
use serde::Serialize;

use crate::parallel;
use crate::setup::Setup;
use crate::trial::Trial;

/// Ways of damping, with their names.
pub const DAMPINGS: [(Damping, &str); 2] =
    [(Damping::MassAware, "D = 2 sqrt(K m)"), (Damping::Literal, "D = 2 sqrt(K), as printed")];
/// Signs, with their names.
pub const SIGNS: [(DeltaSign, &str); 3] =
    [(DeltaSign::Damping, "damping"), (DeltaSign::Off, "off"), (DeltaSign::Literal, "literal")];
/// Lowest stiffness (N/m) and alpha (N/m/s) of the grid.
const STIFFNESS: [f64; 5] = [50.0, 100.0, 200.0, 400.0, 800.0];
const ALPHA: [f64; 10] = [80.0, 130.0, 200.0, 320.0, 500.0, 800.0, 1300.0, 2000.0, 3200.0, 5000.0];
/// The push that sets the arm swinging: force along each axis (N) and duration (s). So small that the feed-forward is
/// far from its bound in the first period.
const PUSH: (f64, f64) = (0.2, 0.1);
/// An arm farther than this from where it is held has lost it (m).
const LOST: f64 = 0.3;

/// One point of the grid.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Point {
    /// How D is formed.
    pub damping: &'static str,
    /// The sign of delta.
    pub sign: &'static str,
    /// K_min (N/m).
    pub stiffness_min: f64,
    /// Feed-forward gain (N/m/s).
    pub alpha: f64,
    /// Largest stable alpha by the closed form, at the weakest of the three axes (N/m/s): with the law's own damping,
    /// which the controller counts on, and with the joints' damping as well.
    pub alpha_max: f64,
    /// See `alpha_max`.
    pub alpha_max_damped: f64,
    /// By the closed form with all of the damping.
    pub predicted_stable: bool,
    /// Largest deviation three natural periods later, as a share of the first.
    pub growth: f64,
    /// On the arm.
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
                jobs.extend(ALPHA.map(|alpha| (damping, sign, stiffness, alpha)));
            }
        }
    }
    parallel::map(&jobs, |&(damping, sign, stiffness, alpha)| point(setup, damping, sign, stiffness, alpha))
        .into_iter()
        .collect()
}

/// The law with its stiffness held at the lowest value, where it is weakest, and adaptation of translation only.
fn law(setup: &Setup, damping: Damping, sign: DeltaSign, stiffness: f64, alpha: f64) -> AdaptiveImpedance {
    let mut law = setup.controller.impedance.aforce;
    law.form.damping = damping;
    (law.sign, law.allow_unstable) = (sign, true);
    law.translation = AxisLaw {
        stiffness_min: stiffness,
        stiffness_start: stiffness,
        stiffness_max: 1.001 * stiffness,
        feedforward_gain: alpha,
        ..law.translation
    };
    law.rotation.feedforward_gain = 0.0;
    law
}

/// One law on the arm.
///
/// # Errors
/// If the configuration is not allowed.
pub fn point(
    setup: &Setup,
    damping: (Damping, &'static str),
    sign: (DeltaSign, &'static str),
    stiffness: f64,
    alpha: f64,
) -> Result<Point> {
    let law = law(setup, damping.0, sign.0, stiffness, alpha);
    let parameters = setup.parameters();
    let limits = TorqueLimits { max: parameters.max_torque, rate: parameters.max_torque_rate };
    let Trial { height, friction, start, .. } = Trial::nominal();
    let plant = Plant { parameters, dt: setup.controller.dt(), config: setup.simulation };
    let (mut simulation, _) = Wipe::simulate(&plant, height, friction);
    simulation.reset(&start);
    let y = simulation.measure();

    let mut config: ControllerConfig = setup.controller;
    config.impedance.aforce = law;
    let space = ActionSpace { impedance: Impedance::Adaptive, force: false };
    let mut controller = Controller::new(space, &config, limits, Vector3::z_axis())?;
    controller.reset(&y);

    let [alpha_max, alpha_max_damped] =
        [JointVector::zeros(), setup.parameters().damping].map(|joints| closed_form(&law, &y, &joints));
    let growth = growth(&mut simulation, &mut controller, stiffness);
    Ok(Point {
        damping: damping.1,
        sign: sign.1,
        stiffness_min: stiffness,
        alpha,
        alpha_max,
        alpha_max_damped,
        predicted_stable: alpha < alpha_max_damped,
        growth,
        stable: growth < 1.0,
    })
}

/// Largest stable alpha of the weakest axis, each with its apparent inertia in the pose `y`; `joints` is the damping of
/// the joints (Nm s/rad).
fn closed_form(law: &AdaptiveImpedance, y: &Measurement, joints: &JointVector) -> f64 {
    let space = OperationalSpace::new(&y.mass, &y.jacobian).expect("a mass matrix");
    let inertia = space.diagonal();
    // Joint velocities of the tool's motion along each axis, rotation left free: M^-1 J^T Lambda.
    let mass = y.mass.cholesky().expect("a mass matrix");
    let motion = mass.solve(&y.jacobian.fixed_rows::<3>(0).transpose()) * space.lambda_p;
    let limit = |axis: usize| {
        let own = law.form.damping.of_axis(law.translation.stiffness_min, inertia[axis], law.form.damping_ratio);
        let damping = own + motion.column(axis).dot(&joints.component_mul(&motion.column(axis)));
        stability_margin(&law.translation, law.sign, inertia[axis], damping).alpha_max
    };
    (0..3).map(limit).fold(f64::INFINITY, f64::min)
}

/// Largest deviation in the fourth natural period after a push, as a share of that in the first.
fn growth(simulation: &mut Simulation, controller: &mut Controller, stiffness: f64) -> f64 {
    const NOMINAL_MASS: f64 = 10.0;
    let dt = simulation.dt();
    let period = TAU * (NOMINAL_MASS / stiffness).sqrt();
    let mut peaks = [0.0f64; 4];
    for step in 0..((PUSH.1 + 4.0 * period) / dt) as usize {
        let time = step as f64 * dt;
        let y = simulation.measure();
        let mut tau = controller.update(&y);
        if time < PUSH.1 {
            tau += y.jacobian.tr_mul(&Wrench::new(PUSH.0, PUSH.0, PUSH.0, 0.0, 0.0, 0.0));
        } else {
            let peak = &mut peaks[(((time - PUSH.1) / period) as usize).min(3)];
            *peak = peak.max(controller.error().fixed_rows::<3>(0).norm());
        }
        if simulation.step(&tau, 0.0).is_err() || controller.error().fixed_rows::<3>(0).norm() > LOST {
            return f64::INFINITY;
        }
    }
    peaks[3] / peaks[0]
}

/// Writes `delta_sign.csv`, `delta_sign.svg`, `delta_sign.png`.
///
/// # Errors
/// If the disk does not take them.
pub fn write(points: &[Point], out: &Path) -> Result<()> {
    let mut table = csv::Writer::from_path(out.join("delta_sign.csv"))?;
    for point in points {
        table.serialize(point)?;
    }
    table.flush()?;
    let panels: Vec<Panel> = DAMPINGS.iter().map(|(_, damping)| panel(points, damping)).collect();
    plot::write(&panels, &out.join("delta_sign"))
}

fn panel(points: &[Point], damping: &str) -> Panel {
    let mut series = vec![];
    for (_, sign) in SIGNS {
        let of = |stiffness: f64| {
            points.iter().filter(move |p| p.damping == damping && p.sign == sign && p.stiffness_min == stiffness)
        };
        let boundary = |stiffness: f64| {
            // Between the last that holds and the first that does not; nothing if all hold.
            let first = of(stiffness).find(|p| !p.stable)?;
            Some((stiffness, (first.alpha / 2f64.sqrt()).log10()))
        };
        let predicted = |stiffness: f64| of(stiffness).next().map(|p| (stiffness, p.alpha_max_damped.log10()));
        series.push(Series {
            label: format!("{sign}, closed form"),
            points: STIFFNESS.into_iter().filter_map(predicted).collect(),
        });
        series.push(Series {
            label: format!("{sign}, on the arm"),
            points: STIFFNESS.into_iter().filter_map(boundary).collect(),
        });
    }
    Panel {
        title: damping.into(),
        x_label: "K_min (N/m)".into(),
        y_label: "log10 of largest stable alpha".into(),
        series,
    }
}
