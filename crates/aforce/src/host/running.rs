//! The law with its bounds, on an arm.

use crate::arm::Arm;
use crate::error::ConfigError;
use crate::host::agreement::Agreement;
use crate::host::bounds::Bounds;
use crate::host::hold::Hold;
use crate::host::interface::{ArmInterface, ArmState, WrenchSource};
use crate::host::limits::HostLimits;
use crate::host::sent::Sent;
use crate::host::setup::{HostSetup, contact_axis};
use crate::host::status::{Command, Fault, Limited, NotTaken, Status};
use crate::law::controller::Controller;
use crate::observer::MomentumObserver;
use crate::spatial::{JointVector, Measurement, Pose, Vector6, Wrench, all_finite, linear, pose_error, rotational};

/// Largest number of cycles in a row whose `dt` of 0 is no fault. Such a cycle is an interface's first, or hands over a state between two
/// cycles. More of them in a row mean that the clock is broken.
const EMPTY_CYCLES: u32 = 5;

/// Share of the nominal period below which the `dt` of a cycle counts as 0. Otherwise a clock that hardly moves could
/// keep the law running without a policy: the time since the latest action is the sum of the cycles' times.
const SHORTEST: f64 = 0.01;

/// A [`Controller`] under the bounds of [`HostLimits`], with a latch for faults and a hold that replaces the law when it does not act.
#[derive(Debug, Clone)]
pub struct Host {
    arm: Arm,
    interface: ArmInterface,
    limits: HostLimits,
    /// Nominal time of a cycle (s).
    period: f64,
    controller: Controller,
    bounds: Bounds,
    agreement: Agreement,
    sent: Sent,
    /// Whether the torque rate is limited relative to a torque that the arm has reported: true from the first [`ArmState::tau`] that could
    /// be read, or from the first start.
    counted: bool,
    hold: Hold,
    observer: Option<MomentumObserver>,
    mode: Mode,
    /// Time since the latest action (s).
    silence: f64,
    /// Number of cycles in a row with a `dt` of 0.
    empty: u32,
    /// The latest measurement that could be read.
    y: Option<Measurement>,
    /// The latest bias that could be read (Nm).
    bias: JointVector,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Stopped,
    Running,
    Fault(Fault),
}

impl Host {
    /// A stopped host. The whole set-up is checked here. Call [`start`](Self::start) before the first torque is sent.
    ///
    /// # Errors
    /// If a value of the set-up is not allowed.
    pub fn new(setup: &HostSetup) -> Result<Self, ConfigError> {
        let contact_off = setup.controller.force.contact_off;
        Ok(Self {
            arm: setup.arm,
            interface: setup.interface,
            limits: setup.limits,
            period: setup.controller.dt(),
            controller: setup.new_controller()?,
            bounds: Bounds::new(&setup.limits, &setup.arm, contact_off, setup.space.unit),
            agreement: Agreement::new(setup.limits.disagreement_max, &setup.arm, setup.interface.gravity),
            sent: Sent::new(&JointVector::zeros()),
            counted: false,
            hold: Hold::new(setup.limits.hold),
            observer: None,
            mode: Mode::Stopped,
            silence: 0.0,
            empty: 0,
            y: None,
            bias: JointVector::zeros(),
        })
    }

    /// Starts the law: goal and set-point at the measured pose, K at its initial value, no force, and the torque rate limited relative to
    /// [`ArmState::tau`]. `model` is the tool's pose at `state.q` (m, base frame) by the host's own kinematics; give `state.pose` if that
    /// pose comes from the same kinematics. The first action has to come within [`HostLimits::silence_max`].
    ///
    /// # Errors
    /// If the state cannot be read, contradicts the model, or is outside of a bound. The host stays as it was.
    pub fn start(&mut self, state: &ArmState, model: &Pose) -> Result<(), Fault> {
        let mut y = self.read(state, 0.0)?;
        self.check_kinematics(&state.pose, model)?;
        let observer = match self.interface.wrench {
            WrenchSource::Reported => None,
            WrenchSource::Observed { cutoff_hz } => {
                y.wrench = Wrench::zeros();
                Some(MomentumObserver::new(cutoff_hz, self.interface.damping(), &y))
            }
        };
        self.check(&y)?;
        self.agreement.at_start(state, &y)?;
        self.check_torques(state, &y)?;
        self.observer = observer;
        self.agreement.reset(state, &y);
        self.controller.reset(&y);
        self.count_from(&state.tau);
        self.bounds.reset(self.controller.own_stiffness());
        (self.mode, self.silence, self.empty) = (Mode::Running, 0.0, 0);
        (self.bias, self.y) = (y.bias, Some(y));
        Ok(())
    }

    /// Stops the law. The arm then holds its posture, with a stiffness that falls to a low value. A fault stays a fault.
    pub fn stop(&mut self) {
        if self.mode == Mode::Running {
            self.leave(Mode::Stopped);
        }
    }

    /// Takes one policy action, entries in [-1, 1] (others are clipped). The goal is computed from the state of the latest cycle. An
    /// action that is not taken leaves the goal as it is and counts as silence.
    ///
    /// # Errors
    /// If the law does not act, the action has another length than the space's, or an entry is NaN.
    pub fn set_goal(&mut self, action: &[f64]) -> Result<(), NotTaken> {
        let expected = self.controller.space().dim();
        // To the law a NaN is an entry of 0, which asks for something: where the goal is absolute, to go back to the start.
        let numbers = action.iter().filter(|entry| !entry.is_nan()).count();
        let found = if action.len() == expected { numbers } else { action.len() };
        if found != expected {
            return Err(NotTaken::Length { found, expected });
        }
        let (Mode::Running, Some(y)) = (self.mode, &self.y) else { return Err(NotTaken::NotRunning) };
        let wanted = self.controller.interpret(action, y);
        let goal = self.bounds.goal(&wanted);
        let planned = self.controller.move_to(&goal);
        self.bounds.goal_limited |= !planned;
        self.silence = 0.0;
        Ok(())
    }

    /// Turns the contact axis, as [`Controller::set_contact_axis`]: `n` is the direction in base axes, of any length, in which the
    /// environment pushes on the tool. The bounds of [`HostLimits`] still hold.
    ///
    /// # Errors
    /// If `n` has no direction; the axis stays as it was.
    pub fn set_contact_axis(&mut self, n: [f64; 3]) -> Result<(), ConfigError> {
        self.controller.set_contact_axis(contact_axis(n)?);
        Ok(())
    }

    /// One cycle: the torque for `state`, `dt` seconds after the last cycle. Never panics, never allocates.
    ///
    /// With a `dt` of 0 (an interface's first cycle), or below a hundredth of the nominal period, the host reads the state and repeats the
    /// last torque, or the torque that the arm reports to have taken. More than five such cycles in a row are a [`Fault::Period`].
    pub fn update(&mut self, state: &ArmState, dt: f64) -> Command {
        let dt = if (0.0..SHORTEST * self.period).contains(&dt) { 0.0 } else { dt };
        self.empty = if dt == 0.0 { self.empty.saturating_add(1) } else { 0 };
        // If `dt` cannot be a period, the hold and the observer go on with the nominal one.
        let step = if self.is_period(dt) { dt } else { self.period };
        let y = self.read(state, step);
        if state.has_bias() {
            self.bias = self.interface.bias(state);
        }
        if !self.counted && state.has_torque() {
            self.count_from(&state.tau);
        }
        let taken = if state.has_torque() { self.sent.taken(&state.tau, step) } else { Ok(None) };
        let wanted = match self.mode {
            Mode::Running => match y.as_ref().map_err(|fault| *fault).and_then(|y| self.driven(state, y, dt, taken)) {
                Ok(tau) => tau,
                Err(fault) => {
                    self.leave(Mode::Fault(fault));
                    self.held(state, step)
                }
            },
            Mode::Stopped | Mode::Fault(_) => self.held(state, step),
        };
        if let Ok(y) = y {
            self.y = Some(y);
        }
        let limiter = self.controller.limiter();
        if let Ok(Some(taken)) = taken {
            limiter.count_from(&taken);
        }
        let tau = limiter.pass(&wanted, &JointVector::zeros(), step.min(self.period));
        self.sent.add(&tau);
        let cut = limiter.excess().iter().any(|excess| *excess != 0.0);
        let status = match self.mode {
            Mode::Stopped => Status::Stopped,
            Mode::Fault(fault) => Status::Fault(fault),
            Mode::Running => {
                let mut limited = std::mem::take(&mut self.bounds.limited);
                limited.insert(Limited::TORQUE, cut);
                limited.insert(Limited::GOAL, self.bounds.goal_limited);
                if limited.is_none() { Status::Running } else { Status::Limited(limited) }
            }
        };
        Command { tau, status }
    }

    /// The controller, for its readings: stiffness, F_ff, set-point, error and more.
    #[must_use]
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// The latest state that could be read, in the law's conventions; `None` before the first.
    #[must_use]
    pub fn measurement(&self) -> Option<&Measurement> {
        self.y.as_ref()
    }

    /// K that acts, in the space's own unit. It grows less than the law asks while the energy tank cannot pay for more.
    #[must_use]
    pub fn acting_stiffness(&self) -> &Vector6 {
        self.bounds.stiffness()
    }

    /// [`acting_stiffness`](Self::acting_stiffness) in N/m and Nm/rad, whatever the space's unit.
    #[must_use]
    pub fn effective_stiffness(&self) -> Vector6 {
        self.controller().effective(self.acting_stiffness())
    }

    /// Level of the energy tank (J).
    #[must_use]
    pub fn tank(&self) -> f64 {
        self.bounds.tank().level()
    }

    /// Whether the host holds the arm and the stiffness has fallen to its lowest value. The program may then end the motion.
    #[must_use]
    pub fn is_relaxed(&self) -> bool {
        self.mode != Mode::Running && self.hold.is_relaxed()
    }

    /// The torque with which the law moves the arm (Nm), before the limits of the joints.
    fn driven(
        &mut self,
        state: &ArmState,
        y: &Measurement,
        dt: f64,
        taken: Result<Option<JointVector>, Fault>,
    ) -> Result<JointVector, Fault> {
        if !self.is_period(dt) {
            return Err(Fault::Period { period: dt, max: self.limits.period_max });
        }
        self.agreement.check(state, y, dt)?;
        if self.limits.disagreement_max.is_finite() {
            taken?;
        }
        if dt == 0.0 {
            return Ok(*self.controller.limiter().previous());
        }
        self.check(y)?;
        self.silence += dt;
        if self.silence > self.limits.silence_max {
            return Err(Fault::Silence { silence: self.silence, max: self.limits.silence_max });
        }
        self.bounded_torque(y, dt).filter(all_finite).ok_or(Fault::Mass)
    }

    /// The steps of [`Controller::update`], with each value bounded before the next step takes it; `None` if the sample cannot be
    /// read.
    fn bounded_torque(&mut self, y: &Measurement, dt: f64) -> Option<JointVector> {
        let (controller, bounds) = (&mut self.controller, &mut self.bounds);
        let mut errors = controller.sense(y, dt)?;
        errors.e = bounds.error(&errors.e);
        errors.excess = bounds.excess(&errors.excess, &errors.axis.release(&errors.e));

        let wanted = controller.adapt(&errors, y);
        let adapted = bounds.adapted(&wanted, &errors, y);

        let task = controller.act(&errors, &adapted);
        let wrench = bounds.wrench(&task, controller.damper_wrench(), y, dt);
        let axis = &errors.axis;
        controller.withhold(axis.along(&(wanted.force - adapted.force)) + axis.along(&(wrench - task)));

        let torque = controller.torque(&wrench, &errors.lambda, y);
        Some(bounds.torque(&torque, y))
    }

    /// The holding torque (Nm). It reads joints and bias alone, because after a fault every other field may be wrong.
    fn held(&mut self, state: &ArmState, dt: f64) -> JointVector {
        if !state.has_joints() {
            // The posture is unknown: repeat the last bias that could be read.
            self.hold.pass(dt);
            return self.bias;
        }
        self.hold.torque(&state.q, &state.qd, dt) + self.bias
    }

    /// Takes `tau` (Nm) as the torque that acts on the arm: the rate of the next torque is limited relative to it.
    fn count_from(&mut self, tau: &JointVector) {
        self.controller.limiter().reset(tau);
        self.sent = Sent::new(self.controller.limiter().previous());
        self.counted = true;
    }

    fn leave(&mut self, mode: Mode) {
        self.mode = mode;
        self.hold.begin();
    }

    /// The state in the law's conventions, `dt` seconds after the last one. An observed wrench is the observer's estimate, zero before the
    /// first start.
    fn read(&mut self, state: &ArmState, dt: f64) -> Result<Measurement, Fault> {
        let reads_wrench = self.reads_wrench();
        if let Some(field) = state.unreadable(reads_wrench) {
            return Err(Fault::Unreadable { field });
        }
        let mut y = self.interface.measurement(state, &self.arm.rotor_inertia.into());
        if !reads_wrench {
            y.wrench = Wrench::zeros();
        }
        if let WrenchSource::Observed { .. } = self.interface.wrench {
            y.wrench = self.observer.as_mut().map_or(Wrench::zeros(), |observer| {
                if dt > 0.0 {
                    observer.update(&state.tau, &y, dt);
                }
                observer.wrench()
            });
        }
        Ok(y)
    }

    /// Whether the reported wrench is read: by force control, or by the limits of what the environment may exert.
    fn reads_wrench(&self) -> bool {
        let reported = self.interface.wrench == WrenchSource::Reported;
        let limited = self.limits.external_max.iter().any(|max| max.is_finite());
        reported && (limited || self.controller.space().force)
    }

    /// Whether `dt` (s) can be the time since the last cycle.
    fn is_period(&self, dt: f64) -> bool {
        if dt == 0.0 { self.empty <= EMPTY_CYCLES } else { dt > 0.0 && dt <= self.limits.period_max }
    }

    fn check_kinematics(&self, pose: &Pose, model: &Pose) -> Result<(), Fault> {
        let e = pose_error(pose, model);
        let (distance, angle) = (linear(&e).norm(), rotational(&e).norm());
        let [max_distance, max_angle] = self.limits.kinematics_tolerance;
        // Written so that a model pose with NaN is refused.
        if distance <= max_distance && angle <= max_angle {
            return Ok(());
        }
        Err(Fault::Kinematics { distance, angle, max_distance, max_angle })
    }

    /// Checks at a start the torque that acts on the arm and the one that the law adds to hold it. Above the arm's limits the first torque
    /// that is sent would be a jump, or too weak to hold the arm.
    fn check_torques(&self, state: &ArmState, y: &Measurement) -> Result<(), Fault> {
        let taken = ("the torque that the arm took last", &state.tau);
        let holding = ("the torque against gravity and Coriolis forces", &y.bias);
        for (what, torques) in [taken, holding] {
            for (i, (&torque, max)) in torques.iter().zip(self.arm.torque_max).enumerate() {
                if torque.abs() > max {
                    return Err(Fault::TorqueMax { joint: i + 1, what, torque, max });
                }
            }
        }
        Ok(())
    }

    /// Checks the ranges and speeds of the joints, the tool's workspace, and the external force and moment.
    fn check(&self, y: &Measurement) -> Result<(), Fault> {
        for (i, ([low, high], max)) in self.arm.range.into_iter().zip(self.arm.speed_max).enumerate() {
            let (joint, position, speed) = (i + 1, y.q[i], y.qd[i].abs());
            if !(low..=high).contains(&position) {
                return Err(Fault::JointRange { joint, position, low, high });
            }
            if speed > max {
                return Err(Fault::JointSpeed { joint, speed, max });
            }
        }
        let margin = self.limits.workspace_margin;
        let [low, high] = self.limits.workspace;
        for (i, ((axis, low), high)) in ['x', 'y', 'z'].into_iter().zip(low).zip(high).enumerate() {
            let (position, low, high) = (y.pose.translation.vector[i], low - margin, high + margin);
            if !(low..=high).contains(&position) {
                return Err(Fault::Workspace { axis, position, low, high });
            }
        }
        let [force_max, moment_max] = self.limits.external_max;
        let (force, moment) = (linear(&y.wrench).norm(), rotational(&y.wrench).norm());
        if force > force_max {
            return Err(Fault::ExternalForce { force, max: force_max });
        }
        if moment > moment_max {
            return Err(Fault::ExternalMoment { moment, max: moment_max });
        }
        Ok(())
    }
}
