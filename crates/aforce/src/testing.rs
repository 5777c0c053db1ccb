//! Arms and parameters for tests.

use nalgebra::UnitQuaternion;

use crate::host::ArmState;
use crate::law::action_space::ActionSpace;
use crate::law::gains::Gains;
use crate::law::psi::{DeltaSign, Psi};
use crate::law::stiffness::Stiffness;
use crate::spatial::{
    Jacobian, JointMatrix, JointVector, Measurement, Pose, Twist, Vector3, Wrench, linear, rotational,
};

/// A generic arm in motion: random Jacobian, random positive definite mass matrix.
pub(crate) fn random_arm(seed: u64) -> Measurement {
    let mut state = seed;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    let jacobian = Jacobian::from_fn(|_, _| random());
    let root = JointMatrix::from_fn(|_, _| random());
    let q = JointVector::from_fn(|_, _| random());
    let qd = JointVector::from_fn(|_, _| 0.3 * random());
    Measurement {
        q,
        qd,
        pose: Pose::identity(),
        twist: jacobian * qd,
        jacobian,
        mass: root * root.transpose() + JointMatrix::identity() * 0.3,
        bias: JointVector::from_fn(|_, _| 5.0 * random()),
        wrench: Wrench::zeros(),
    }
}

/// A random arm at rest within a Panda's ranges, its tool in front of the base.
pub(crate) fn resting_arm() -> ArmState {
    let y = random_arm(8);
    ArmState {
        q: JointVector::from([0.0, 0.2, 0.0, -2.0, 0.0, 2.2, 0.8]),
        qd: JointVector::zeros(),
        pose: Pose::new(Vector3::new(0.5, 0.0, 0.3), Vector3::new(3.1, 0.0, 0.0)),
        jacobian: y.jacobian,
        mass: y.mass,
        gravity: y.bias,
        coriolis: JointVector::repeat(0.01),
        wrench: Wrench::zeros(),
        tau: JointVector::zeros(),
    }
}

/// Six axes that move the tool along and about the world axes with the given inertias (kg, kg m^2), and an idle
/// seventh joint: the torques of joints 1 to 6 are the tool's wrench.
pub(crate) fn gantry(inertia: [f64; 6]) -> Measurement {
    let mut mass = JointMatrix::identity();
    for (i, m) in inertia.into_iter().enumerate() {
        mass[(i, i)] = m;
    }
    Measurement {
        q: JointVector::zeros(),
        qd: JointVector::zeros(),
        pose: Pose::identity(),
        twist: Twist::zeros(),
        jacobian: Jacobian::identity(),
        mass,
        bias: JointVector::zeros(),
        wrench: Wrench::zeros(),
    }
}

/// Moves the gantry's tool for `dt` seconds under joint torques and what the environment exerts (semi-implicit Euler).
pub(crate) fn move_gantry(y: &mut Measurement, tau: &JointVector, external: &Wrench, dt: f64) {
    for i in 0..7 {
        let push = if i < 6 { external[i] } else { 0.0 };
        y.qd[i] += dt * (tau[i] - y.bias[i] + push) / y.mass[(i, i)];
    }
    y.q += y.qd * dt;
    y.twist = y.jacobian * y.qd;
    y.pose.translation.vector += linear(&y.twist) * dt;
    y.pose.rotation = UnitQuaternion::from_scaled_axis(rotational(&y.twist) * dt) * y.pose.rotation;
}

/// Parameters in N/m that are easy to calculate with: the tolerance is 5 mm and 0.05 rad, and K relaxes in a second.
pub(crate) fn psi() -> Psi {
    Psi {
        alpha: Gains::pair(100.0, 5.0),
        beta: Gains::pair(1.5e5, 900.0),
        gamma: Gains::pair(750.0, 45.0),
        mu: Gains::all(1.0),
        delta: Gains::all(0.05),
        delta_sign: DeltaSign::Damping,
        k_min: Gains::pair(50.0, 5.0),
        k_max: Gains::pair(800.0, 50.0),
        k_0: Gains::pair(200.0, 20.0),
        f_ff_max: Gains::pair(15.0, 3.0),
        k_rate_max: Gains::pair(5000.0, 500.0),
        f_ff_rate_max: Gains::pair(1000.0, 500.0),
        inertia: Gains::pair(42.0, 3.0),
        anti_windup: true,
        allow_unstable: false,
    }
}

/// `aforce` with the law [`psi`].
pub(crate) fn adaptive(psi: Psi) -> ActionSpace {
    ActionSpace { stiffness: Stiffness::Adaptive(psi), ..crate::testing::space("aforce") }
}

/// A built-in space.
pub(crate) fn space(name: &str) -> ActionSpace {
    name.parse().unwrap()
}
