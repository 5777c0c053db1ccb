//! What a caller may change while an episode runs.

use aforce::{ActionSpace, ConfigError, Stiffness, stable_on};
use physics::Push;

use super::Env;
use crate::disturbance::{Disturbance, Draw};
use crate::privileged::Privileged;

impl Env {
    /// Applies an external force to a moving body until this is called again or the episode ends. `None` removes the force.
    ///
    /// # Panics
    /// In the next sample, if the body is fixed.
    pub fn push(&mut self, push: Option<Push>) {
        self.simulation.set_hand(push);
    }

    /// Changes the numbers of the action space's stiffness, in this episode and the next ones: see [`aforce::Controller::set_stiffness`].
    ///
    /// # Errors
    /// As [`aforce::Controller::set_stiffness`], and if the adaptive law would be unstable where the arm is now.
    pub fn set_stiffness(&mut self, stiffness: Stiffness) -> Result<(), ConfigError> {
        let space = ActionSpace { stiffness, ..self.config.space.clone() };
        space.validate(self.config.controller.control_hz).map_err(|error| error.below("env"))?;
        stable_on(&space, &self.y).map_err(|error| error.below("env.space"))?;
        self.controller.set_stiffness(stiffness).map_err(|error| error.below("env"))?;
        self.config.space = space;
        Ok(())
    }

    /// Sets the delay of the joint torques (s), rounded up to whole control samples, in this episode and the next ones.
    ///
    /// # Errors
    /// If `delay` is not between 0 and 0.2 s. If a critic sees the disturbances and the configuration had no delay: the
    /// critic would see one number more.
    pub fn set_torque_delay(&mut self, delay: f64) -> Result<(), ConfigError> {
        let is_new = self.config.disturbance.torque_delay_s.is_none();
        if is_new && self.config.observation.critic.contains(&Privileged::Disturbance) {
            let reason = "a critic sees \"disturbance\", which had no delay when it began".into();
            return Err(ConfigError::Contradiction { field: "env.disturbance.torque_delay_s".into(), reason });
        }
        let torque_delay_s = Some(Draw::Fixed(delay));
        let disturbance = Disturbance { torque_delay_s, ..self.config.disturbance.clone() };
        disturbance.validate(self.config.task).map_err(|error| error.below("env"))?;
        self.config.disturbance = disturbance;
        self.drawn.set_delay(delay, &self.y.bias, self.plant.dt);
        Ok(())
    }
}
