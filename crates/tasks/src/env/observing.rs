//! What a policy and a critic see of an environment.

use aforce::ConfigError;

use super::Env;
use crate::controller_state::observe_controller;
use crate::disturbance::Disturbance;
use crate::observation::observe_robot;
use crate::observer::{Component, Observer};
use crate::pixels::Pixels;
use crate::privileged::{Privileged, observe_contact};

impl Env {
    pub(super) fn observe(&mut self) {
        self.observer.begin();
        self.task.observe(&self.simulation, &self.y, &mut self.observer);
        observe_robot(&self.simulation, &self.y, &mut self.observer);
        if self.config.observation.controller {
            observe_controller(&self.controller, &self.y, &mut self.observer);
        }
        if self.config.observation.force {
            self.sensor.observe(&self.y, &mut self.observer);
        }
        if self.config.observation.action {
            for (name, entry) in &self.last_action {
                self.observer.put(format_args!("action_{name}"), *entry, "-1 to 1", 0.0, 1.0);
            }
        }
        self.observe_privileged();
        for (observer, whom) in [(&self.observer, "a policy"), (&self.privileged, "a critic")] {
            let (now, first) = (observer.values().len(), observer.components().len());
            assert!(
                now == first,
                "task {}: {now} numbers are shown to {whom} after action {}, {first} were at first; `observe` puts the same ones every time",
                self.task.name(),
                self.elapsed
            );
        }
    }

    fn observe_privileged(&mut self) {
        let (out, simulation, y) = (&mut self.privileged, &self.simulation, &self.y);
        out.begin();
        for entry in &self.config.observation.critic {
            match entry {
                Privileged::Contact => observe_contact(simulation, out),
                Privileged::Controller => observe_controller(&self.controller, y, out),
                Privileged::Disturbance => self.config.disturbance.observe(&self.drawn, out),
                Privileged::Force => self.sensor.observe(y, out),
                Privileged::Task => self.task.observe_privileged(simulation, y, out),
            }
        }
    }

    /// The last observation: object part, proprioception, then the controller's state, the measured force and the last action where
    /// they are observed; unscaled.
    pub fn observation(&self) -> &[f32] {
        self.observer.values()
    }

    /// Names and scales of the observation's components, in order.
    pub fn observation_components(&self) -> &[Component] {
        self.observer.components()
    }

    /// What a critic sees in addition to the last observation ([`ObservationOptions::critic`](crate::ObservationOptions::critic)), in the
    /// order of that list; unscaled. A policy must not see these numbers.
    pub fn privileged(&self) -> &[f32] {
        self.privileged.values()
    }

    /// Names and scales of [`Env::privileged`]'s components, in order.
    pub fn privileged_components(&self) -> &[Component] {
        self.privileged.components()
    }

    /// The present picture of the observed camera, rendered at every call; `None` in an environment without one.
    pub fn pixels(&self) -> Option<Pixels> {
        self.config.observation.camera.map(|camera| camera.take(self.task(), self.simulation()))
    }

    /// Checks that no entry of the critic's list is empty.
    pub(super) fn shows_what_is_asked(&self) -> Result<(), ConfigError> {
        let critic = &self.config.observation.critic;
        let mut shown = Observer::default();
        shown.begin();
        self.task.observe_privileged(&self.simulation, &self.y, &mut shown);
        let nothing_disturbed = self.config.disturbance == Disturbance::default();
        let reason = if critic.contains(&Privileged::Disturbance) && nothing_disturbed {
            "\"disturbance\" shows what env.disturbance has, and it has nothing".into()
        } else if critic.contains(&Privileged::Task) && shown.values().is_empty() {
            format!("{} has nothing to show to a critic: leave \"task\" out", self.task.name())
        } else {
            return Ok(());
        };
        Err(ConfigError::Contradiction { field: "env.observation.critic".into(), reason })
    }
}
