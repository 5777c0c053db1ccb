//! The action spaces that are compared: they differ in where the stiffness comes from, and in nothing else.

use aforce::{
    ActionSpace, Damping, DeltaSign, Gains, GoalRule, Psi, RateRule, RotationError, SetPoint, Stiffness, StiffnessUnit,
};

/// Place of the adaptive space among [`Setup::spaces`](crate::Setup::spaces).
pub const AFORCE: usize = 0;
/// Place of the space that the others are compared with.
pub const HIGH: usize = 3;

/// Translation (N/m) and rotation (Nm/rad) of low, mid, high.
const LEVELS: [(f64, f64); 3] = [(150.0, 10.0), (500.0, 30.0), (1500.0, 100.0)];

/// Adaptive, and stiffness fixed at low, mid, high, each with the same force controller.
pub(crate) fn spaces() -> [ActionSpace; 4] {
    let [low, mid, high] = LEVELS.map(|(translation, rotation)| Gains::pair(translation, rotation));
    [
        ("aforce-force", Stiffness::Adaptive(psi(low, mid, high))),
        ("low-force", Stiffness::Fixed(low)),
        ("mid-force", Stiffness::Fixed(mid)),
        ("high-force", Stiffness::Fixed(high)),
    ]
    .map(|(name, stiffness)| ActionSpace {
        name: name.into(),
        // The leash is a guard against runaway goals, not a part of the law: low lags by centimetres.
        goal: GoalRule::Continued { leash_position: 0.1, leash_rotation: 0.5 },
        set_point: SetPoint::Interpolated,
        rate: RateRule::SetPoint,
        rotation_error: RotationError::Angle,
        unit: StiffnessUnit::NewtonPerMetre,
        damping: Damping::MassAware,
        damping_ratio: Gains::all(1.0),
        force: true,
        stiffness,
        commanded_psi: None,
    })
}

/// The law ranges from low to high and starts at mid.
fn psi(low: Gains, mid: Gains, high: Gains) -> Psi {
    // Error that does not stiffen (m, rad), and time in which K falls from high to low without one (s).
    let (tolerance, relaxation_time) = (Gains::pair(0.005, 0.01), 1.0);
    let gamma = high.map(|axis, high| (high - low[axis]) / relaxation_time);
    Psi {
        alpha: Gains::pair(100.0, 5.0),
        beta: gamma.map(|axis, gamma| gamma / tolerance[axis]),
        gamma,
        mu: Gains::all(1.0),
        delta: Gains::all(0.05),
        delta_sign: DeltaSign::Damping,
        k_min: low,
        k_max: high,
        k_0: mid,
        f_ff_max: Gains::pair(15.0, 3.0),
        k_rate_max: Gains::pair(5000.0, 500.0),
        f_ff_rate_max: Gains::pair(1000.0, 500.0),
        inertia: Gains::pair(25.0, 6.0),
        // This arm also limits how fast a torque changes, which is no wind-up: where set-points jerk (two rows of variants.csv)
        // anti-windup would answer to that.
        anti_windup: false,
        allow_unstable: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setup::Setup;
    use crate::trial::Trial;
    use aforce::OperationalSpace;
    use physics::scenes::wipe::scene;
    use physics::wiping_tool::GRIP_SITE;

    /// The certificate of stability is asked for at the largest apparent inertia, in any direction.
    #[test]
    fn nominal_inertia_covers_the_arm() {
        let setup = Setup::default();
        let Trial { height, friction, start, .. } = Trial::nominal();
        let (scene, tool) = scene(&setup.arm(), height, friction);
        let model = physics::model::Model::new(&scene, tool, GRIP_SITE);
        let y = model.measure(start, start * 0.0, aforce::Wrench::zeros());
        let arm = OperationalSpace::new(&y.mass, &y.jacobian).unwrap();
        let psi = setup.spaces[AFORCE].psi().unwrap();
        for (inertia, nominal) in [(arm.lambda_p, psi.inertia[0]), (arm.lambda_o, psi.inertia[3])] {
            let heaviest = inertia.symmetric_eigenvalues().max();
            assert!((0.6..1.0).contains(&(heaviest / nominal)), "{heaviest}");
        }
    }
}
