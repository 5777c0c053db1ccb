//! A simulated arm for tests of the host: a Panda's joints with a ball in each link. Its kinematics and dynamics are exact, so that all
//! parts of its state agree.

use std::f64::consts::FRAC_PI_2;

use aforce::host::{ArmInterface, ArmState, CompensatedBy, InertiaSide, WrenchSign};
use aforce::{Arm, Jacobian, JointMatrix, JointVector, Pose, Vector3, Wrench};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};

/// Denavit-Hartenberg's a, alpha and d of Franka's documentation (Craig's convention; m, rad), and the tool point behind the last joint.
const A: [f64; 7] = [0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088];
const ALPHA: [f64; 7] = [0.0, -FRAC_PI_2, FRAC_PI_2, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2, FRAC_PI_2];
const D: [f64; 7] = [0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0];
const TOOL: f64 = 0.21;
/// Each link's ball: mass (kg), inertia about its centre (kg m^2), place in the link's frame (m).
const MASS: [f64; 7] = [3.0, 3.0, 3.0, 3.0, 2.5, 1.5, 1.2];
const INERTIA: [f64; 7] = [0.03, 0.03, 0.03, 0.03, 0.02, 0.005, 0.004];
const PLACE: [[f64; 3]; 7] = [
    [0.0, -0.03, -0.07],
    [0.0, -0.07, 0.03],
    [0.04, 0.03, -0.05],
    [-0.04, 0.05, 0.03],
    [0.0, 0.03, -0.1],
    [0.05, 0.0, -0.01],
    [0.0, 0.0, 0.1],
];
const GRAVITY: f64 = 9.81;
/// Damping of each joint (Nm s/rad), which is not compensated.
const DAMPING: f64 = 0.5;

/// A posture in front of the base, its tool downwards (rad).
pub const HOME: [f64; 7] = [0.1, -0.5, 0.05, -2.2, 0.1, 1.75, 0.8];

/// The arm in motion.
pub struct BallArm {
    pub q: JointVector,
    pub qd: JointVector,
    /// The torque that the arm took last (Nm).
    pub tau: JointVector,
    /// What the environment exerts on the tool (N, Nm; base axes).
    pub wrench: Wrench,
    pub interface: ArmInterface,
}

struct Dynamics {
    pose: Pose,
    jacobian: Jacobian,
    mass: JointMatrix,
    gravity: JointVector,
    coriolis: JointVector,
}

fn dynamics(q: &JointVector, qd: &JointVector) -> Dynamics {
    let mut frame = Pose::identity();
    let (mut axes, mut origins) = ([Vector3::zeros(); 7], [Vector3::zeros(); 7]);
    let (mut turn, mut turning, mut pull) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
    let (mut mass, mut gravity, mut coriolis) = (JointMatrix::zeros(), JointVector::zeros(), JointVector::zeros());
    for link in 0..7 {
        let across = UnitQuaternion::from_scaled_axis(Vector3::x() * ALPHA[link]);
        let step = Isometry3::from_parts(Translation3::new(A[link], 0.0, 0.0), across)
            * Isometry3::from_parts(
                Translation3::new(0.0, 0.0, D[link]),
                UnitQuaternion::from_scaled_axis(Vector3::z() * q[link]),
            );
        let before = frame.translation.vector;
        frame *= step;
        let (axis, origin) = (frame.rotation * Vector3::z(), frame.translation.vector);
        // Angular velocity (`turn`), angular acceleration (`turning`) and acceleration of the frame's origin (`pull`)
        // with all joint accelerations zero. The link before carries this joint.
        let along = origin - before;
        pull += turning.cross(&along) + turn.cross(&turn.cross(&along));
        turning += turn.cross(&(axis * qd[link]));
        turn += axis * qd[link];
        (axes[link], origins[link]) = (axis, origin);

        let ball = frame.rotation * Vector3::from(PLACE[link]);
        let acceleration = pull + turning.cross(&ball) + turn.cross(&turn.cross(&ball));
        let at = origin + ball;
        let columns: Vec<(Vector3, Vector3)> =
            (0..=link).map(|joint| (axes[joint].cross(&(at - origins[joint])), axes[joint])).collect();
        for (i, (linear, angular)) in columns.iter().enumerate() {
            gravity[i] += MASS[link] * GRAVITY * linear.z;
            coriolis[i] += MASS[link] * linear.dot(&acceleration) + INERTIA[link] * angular.dot(&turning);
            for (j, (other, other_angular)) in columns.iter().enumerate() {
                mass[(i, j)] += MASS[link] * linear.dot(other) + INERTIA[link] * angular.dot(other_angular);
            }
        }
    }
    let pose = frame * Isometry3::translation(0.0, 0.0, TOOL);
    let mut jacobian = Jacobian::zeros();
    for joint in 0..7 {
        let linear = axes[joint].cross(&(pose.translation.vector - origins[joint]));
        jacobian.fixed_view_mut::<3, 1>(0, joint).copy_from(&linear);
        jacobian.fixed_view_mut::<3, 1>(3, joint).copy_from(&axes[joint]);
    }
    Dynamics { pose, jacobian, mass, gravity, coriolis }
}

impl BallArm {
    /// At rest, held against gravity.
    pub fn at(q: [f64; 7], interface: ArmInterface) -> Self {
        let (q, qd) = (JointVector::from(q), JointVector::zeros());
        let tau = match interface.gravity {
            CompensatedBy::Law => dynamics(&q, &qd).gravity,
            CompensatedBy::Arm => JointVector::zeros(),
        };
        Self { q, qd, tau, wrench: Wrench::zeros(), interface }
    }

    fn rotors(&self) -> JointMatrix {
        JointMatrix::from_diagonal(&Arm::FR3.rotor_inertia.into())
    }

    /// The state that the arm's interface reports, in the conventions of `interface`.
    pub fn state(&self) -> ArmState {
        let Dynamics { pose, jacobian, mass, gravity, coriolis } = dynamics(&self.q, &self.qd);
        let rotors = match self.interface.inertia {
            InertiaSide::Link => JointMatrix::zeros(),
            InertiaSide::Motor => self.rotors(),
        };
        let wrench = match self.interface.wrench_sign {
            WrenchSign::OnTool => self.wrench,
            WrenchSign::OnEnvironment => -self.wrench,
        };
        let (q, qd, tau) = (self.q, self.qd, self.tau);
        ArmState { q, qd, pose, jacobian, mass: mass + rotors, gravity, coriolis, wrench, tau }
    }

    /// Moves by `dt` seconds under the torque that it took and the wrench at its tool.
    pub fn advance(&mut self, dt: f64) {
        let Dynamics { jacobian, mass, gravity, coriolis, .. } = dynamics(&self.q, &self.qd);
        let own = match self.interface.gravity {
            CompensatedBy::Law => JointVector::zeros(),
            CompensatedBy::Arm => gravity,
        };
        let torque = self.tau + own - gravity - coriolis - DAMPING * self.qd + jacobian.tr_mul(&self.wrench);
        let inertia = (mass + self.rotors()).cholesky().expect("a mass matrix");
        self.qd += dt * inertia.solve(&torque);
        self.q += dt * self.qd;
    }

    /// Position of the tool (m, base frame).
    #[allow(dead_code, reason = "not every test looks")]
    pub fn tool(&self) -> Vector3 {
        dynamics(&self.q, &self.qd).pose.translation.vector
    }
}
