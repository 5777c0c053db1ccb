//! Everything that is the same in every wipe.

use std::path::Path;

use aforce::{
    AdaptiveImpedance, AxisLaw, ControllerConfig, Convention, FixedImpedance, ForceConfig, ImpedanceForm,
    ImpedanceSettings, Interpolation, Reference,
};
use anyhow::{Result, anyhow, ensure};
use output::program::bad;
use physics::SimulationConfig;
use physics::panda::{ParameterSet, Parameters};
use serde::{Deserialize, Serialize};

use crate::sensing::Sensing;

/// Arm, controller, wrench sensing, and what the script does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    /// Lowest and highest contact force at which paint comes off (N).
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
    /// From a file with every setting, such as the `config.toml` of an earlier run.
    ///
    /// # Errors
    /// If it cannot be read, a setting is missing or unknown, or a value is not allowed.
    pub fn read(path: &Path) -> Result<Self> {
        let text = fs_err::read_to_string(path)?;
        let setup = toml::from_str(&text)
            .map_err(|error| anyhow!("not a complete set-up: {}", error.message()))
            .and_then(Setup::validated);
        setup.map_err(|error| bad(format!("{}: {error:#}", path.display())))
    }

    fn validated(self) -> Result<Self> {
        let ranges = [
            ("force", self.force, 0.0..=self.controller.force.force_max),
            ("press_time", self.press_time, 0.0..=60.0),
            ("rotations", f64::from(self.rotations), 1.0..=1000.0),
            ("circle_radius", self.circle_radius, 0.0..=0.2),
            ("period", self.period, 0.1..=60.0),
            ("spot_radius", self.spot_radius, 0.01..=0.2),
        ];
        for (name, value, range) in ranges {
            aforce::within(name, value, range)?;
        }
        let [low, high] = self.wiping_force;
        ensure!(low < high, "wiping_force: {low} is not below {high}");
        self.sensing.validate().and(self.simulation.validate())?;
        let controller = self.controller.validate().and_then(|()| self.controller.impedance.aforce.check_stability());
        controller.map_err(|error| error.below("controller"))?;
        Ok(self)
    }

    /// The arm.
    pub(crate) fn parameters(&self) -> Parameters {
        let mut parameters = self.robot.parameters();
        if self.lossless {
            parameters.damping.fill(0.0);
            parameters.friction.fill(0.0);
        }
        parameters
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::Trial;
    use aforce::OperationalSpace;
    use physics::scenes::wipe::scene;
    use physics::wiping_tool::GRIP_SITE;

    #[test]
    fn a_setup_reads_back_and_a_wrong_one_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("config.toml");
        let text = toml::to_string(&Setup::default()).unwrap();
        let read = |text: String| {
            fs_err::write(&file, text).unwrap();
            Setup::read(&file).map_err(|error| format!("{error:#}"))
        };
        assert_eq!(read(text.clone()).unwrap(), Setup::default());
        for (setting, change, word) in [
            ("force = 10.0", "force = 99.0", "force"),
            ("force = 10.0", "forse = 10.0", "forse"),
            ("force = 10.0", "", "force"),
            ("bias = [0.5", "bias = [-0.5", "sensing.bias[0]"),
            ("noise = [0.3", "noise = [nan", "sensing.noise[0]"),
            ("substeps = 1", "substeps = 0", "simulation.substeps"),
            ("ki = 16.0", "ki = -1.0", "controller.force.ki"),
            ("forgetting = 1.0", "forgetting = 1e9", "controller.impedance.aforce.translation.forgetting"),
        ] {
            let changed = text.replacen(setting, change, 1);
            assert_ne!(changed, text, "{setting}");
            let error = read(changed).unwrap_err();
            assert!(error.contains(word) && error.contains("config.toml"), "{error}");
        }
    }

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
