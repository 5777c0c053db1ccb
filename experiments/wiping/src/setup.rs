//! Everything that is the same in every wipe.

use aforce::{
    AdaptiveImpedance, AxisLaw, ControllerConfig, Convention, FixedImpedance, ForceConfig, ImpedanceForm,
    ImpedanceSettings, Interpolation, Reference,
};
use physics::SimulationConfig;
use physics::panda::{ParameterSet, Parameters};
use serde::Serialize;

use crate::sensing::Sensing;

/// Arm, controller, wrench sensing, and what the script does.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setup {
    /// The arm's numbers.
    pub robot: ParameterSet,
    /// The joints without damping and the table without friction: what wiping costs then is the controller's own.
    pub lossless: bool,
    /// Force to press with (N).
    pub force: f64,
    /// Time of pressing without motion (s).
    pub press_time: f64,
    /// Circles.
    pub rotations: u32,
    /// Their radius (m).
    pub circle_radius: f64,
    /// Time of one (s).
    pub period: f64,
    /// Radius of the spot of paint (m): tracked exactly, the circles cover 0.5 cm more.
    pub spot_radius: f64,
    /// Contact force between which paint comes off (N).
    pub wiping_force: [f64; 2],
    /// How the external wrench is known.
    pub sensing: Sensing,
    /// Engine settings.
    pub simulation: SimulationConfig,
    /// The controller: of its impedances `aforce`, `low`, `mid` and `high` are used.
    pub controller: ControllerConfig,
}

impl Default for Setup {
    fn default() -> Self {
        Setup {
            robot: ParameterSet::Identified,
            lossless: false,
            force: 10.0,
            press_time: 3.0,
            rotations: 8,
            circle_radius: 0.05,
            period: 2.5,
            spot_radius: 0.07,
            wiping_force: [5.0, 60.0],
            sensing: Sensing::default(),
            simulation: SimulationConfig::default(),
            controller: ControllerConfig {
                control_hz: 1000,
                // Braking takes longer than an action: the set-point circles without stopping 20 times a second.
                interpolation: Interpolation::JerkLimited { dynamics: 0.15 },
                // Faster than the circle, below the limit (1 + kp) D/M = 26 1/s of the damped axis on a stiff table.
                force: ForceConfig { ki: 16.0, ..ForceConfig::default() },
                impedance: impedances(),
                ..ControllerConfig::default()
            },
        }
    }
}

/// N/m, Nm/rad of low, mid, high.
const LEVELS: [(f64, f64); 3] = [(150.0, 10.0), (500.0, 30.0), (1500.0, 100.0)];

/// Every impedance in N/m, with the paper's e_dot; the adaptive one ranges from low to high and starts at mid.
fn impedances() -> ImpedanceSettings {
    let form = ImpedanceForm {
        reference_velocity: true,
        // A guard against runaway goals, not a part of the law: low lags by centimetres.
        reference: Reference::Continued { leash_position: 0.1, leash_rotation: 0.5 },
        ..ImpedanceForm::continued(Convention::Physical)
    };
    let [low, mid, high] = LEVELS;
    let physical = AdaptiveImpedance::physical();
    let translation = AxisLaw {
        stiffness_min: low.0,
        stiffness_start: mid.0,
        stiffness_max: high.0,
        nominal_inertia: 25.0,
        ..physical.translation
    };
    let rotation = AxisLaw {
        stiffness_min: low.1,
        stiffness_start: mid.1,
        stiffness_max: high.1,
        tolerance: 0.01,
        nominal_inertia: 6.0,
        ..physical.rotation
    };
    let fixed = |(translation, rotation)| FixedImpedance { form, translation, rotation };
    ImpedanceSettings {
        aforce: AdaptiveImpedance { form, translation, rotation, ..physical },
        low: fixed(low),
        mid: fixed(mid),
        high: fixed(high),
        ..ImpedanceSettings::default()
    }
}

impl Setup {
    /// The arm.
    pub(crate) fn parameters(&self) -> Parameters {
        let mut parameters = self.robot.parameters();
        if self.lossless {
            parameters.damping.fill(0.0);
        }
        parameters
    }

    /// Entry of an action that asks for the force to press with.
    pub(crate) fn force_entry(&self) -> f64 {
        2.0 * self.force / self.controller.force.force_max - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::Trial;
    use aforce::OperationalSpace;
    use physics::scenes::wipe::scene;
    use physics::wiping_tool::GRIP_SITE;

    /// The certificate of stability is asked for at the largest apparent inertia, in any direction.
    #[test]
    fn nominal_inertia_covers_the_arm() {
        let setup = Setup::default();
        let Trial { height, friction, start, .. } = Trial::nominal();
        let (scene, tool) = scene(&setup.parameters(), height, friction);
        let model = physics::model::Model::new(&scene, tool, GRIP_SITE);
        let y = model.measure(start, start * 0.0, aforce::Wrench::zeros());
        let inertia = OperationalSpace::new(&y.mass, &y.jacobian).unwrap();
        let law = setup.controller.impedance.aforce;
        for (inertia, law) in [(inertia.lambda_p, law.translation), (inertia.lambda_o, law.rotation)] {
            let heaviest = inertia.symmetric_eigenvalues().max();
            assert!((0.6..1.0).contains(&(heaviest / law.nominal_inertia)), "{heaviest}");
        }
        law.check_stability().unwrap();
    }
}
