//! Connect, check, move to the start, run, relax, end.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use aforce::host::{ArmState, CompensatedBy, Host, HostSetup, InertiaSide, NotTaken, Status, WrenchAxes, WrenchSource};
use aforce::{Arm, EnergyLedger, JointVector, Vector3};
use anyhow::{Context, Result, anyhow, bail, ensure};
use franka::{FciVersion, Model, RealtimeConfig, Robot, RobotMode, RobotState, Torques, motion_finished};
use signal_hook::consts::{SIGINT, SIGTERM};

use crate::arm::{arm_state, model_pose};
use crate::cli::{Args, Script};
use crate::csv_log::{Log, Row};
use crate::policy::Policy;
use crate::rehearsal::add_table;
use crate::script::Running;
use crate::{checks, motion};

/// Cycles per row of the log.
const LOGGED: u64 = 10;
/// The robot refuses torque rates of 1000 Nm/s, and compares in single precision.
const RATE_SHARE: f64 = 0.99;
/// Torque (Nm) at which the robot itself stops, and force (N, Nm): so much above what the set-up calls a fault, up to a largest.
const COLLISION_TORQUE: [f64; 7] = [60.0, 60.0, 60.0, 60.0, 12.0, 12.0, 12.0];
const COLLISION_MARGIN: f64 = 1.5;
const COLLISION_MAX: f64 = 100.0;
const IDENTITY: [f64; 16] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Who says what to do.
enum Source {
    Script(Running),
    Policy(Policy),
}

/// All of it.
pub fn run(args: &Args) -> Result<()> {
    let setup = read_setup(args)?;
    let mut host = Host::new(&setup)?;
    ensure!(args.duration > 0.0, "--duration {}: must be above 0", args.duration);
    let wipes = args.script == Some(Script::Wipe);
    ensure!(!wipes || setup.space.force, "--script wipe presses: `{}` has space.force = false", setup.space);
    let interface = &setup.interface;
    let reported = interface.wrench == WrenchSource::Reported;
    ensure!(
        reported || args.no_push_check,
        "interface.wrench is observed: a push shows what the arm reports, which the law does not read; --no-push-check"
    );
    ensure!(
        args.rehearse_table.is_none() || reported && interface.wrench_axes == WrenchAxes::Base,
        "--rehearse-table adds to a wrench that the arm reports in base axes: see interface.wrench and wrench_axes"
    );
    let contact_axis = Vector3::from(setup.contact_axis).normalize();
    let up = (contact_axis - Vector3::z()).norm() < 1e-6;
    for (option, given) in [("--script wipe", wipes), ("--rehearse-table", args.rehearse_table.is_some())] {
        ensure!(
            !given || up,
            "{option} has its table below: contact_axis is {:?}, [0.0, 0.0, 1.0] would be right",
            setup.contact_axis
        );
    }
    let start = args.start.as_deref().map(|start| within(start, &setup.arm)).transpose()?;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }

    let realtime = if args.no_realtime { RealtimeConfig::Ignore } else { RealtimeConfig::Enforce };
    let robot = Robot::new(&args.robot, realtime).with_context(|| format!("--robot {}", args.robot))?;
    println!("connected: {:?}, {:?}", args.robot, robot.fci_version());
    check_range(&setup.arm, robot.fci_version())?;
    prepare(&robot, &setup)?;
    let model = robot.load_model().context("the robot's model")?;
    if let Some(start) = start {
        motion::move_to(&robot, start, &stop)?;
        checks::go_on(&stop)?;
    }
    if !args.no_push_check {
        checks::push_by_hand(&robot, &model, &setup, &stop)?;
    }

    // Everything that can be refused is refused before a torque flows.
    let read = |state: &RobotState| {
        let mut arm = arm_state(state, &model);
        if let Some(height) = args.rehearse_table {
            add_table(&mut arm, height, setup.interface.wrench_sign);
        }
        arm
    };
    let state = robot.read_once()?;
    let arm = read(&state);
    host.start(&arm, &model_pose(&state, &model)).map_err(|fault| anyhow!("{fault}: refused"))?;
    let mut first = None;
    let source = match (&args.policy, args.script) {
        (Some(command), _) => {
            let mut policy = Policy::start(command)?;
            policy.ask(&host);
            first = Some(policy.first(&host, &stop)?);
            Source::Policy(policy)
        }
        (None, Some(script)) => Source::Script(Running::new(script, arm.pose)),
        (None, None) => bail!("--script or --policy"),
    };
    let log = args.log.as_deref().map(Log::create).transpose()?;

    let mut act =
        Act { setup: &setup, contact_axis, host, source, first, log, stop, duration: args.duration, refused: None };
    let outcome = act.control(&robot, &model, &read);
    let written = act.log.take().map_or(Ok(()), Log::finish);
    outcome.and(written)
}

fn read_setup(args: &Args) -> Result<HostSetup> {
    let (name, text) = match &args.setup {
        Some(path) => {
            let name = path.display().to_string();
            (name.clone(), std::fs::read_to_string(path).with_context(|| name)?)
        }
        None => ("configs/fr3.toml".to_owned(), include_str!("../configs/fr3.toml").to_owned()),
    };
    let mut setup = HostSetup::from_toml(&text).map_err(|error| anyhow!("{name}: {error}"))?;
    ensure!(setup.controller.control_hz == 1000, "{name}: controller.control_hz must be 1000, the arm's rate");
    ensure!(
        setup.interface.gravity == CompensatedBy::Arm,
        "{name}: interface.gravity is \"law\": a Franka compensates gravity itself, twice would throw it up; \
         interface = \"franka\", or {{ extends = \"franka\", .. }}"
    );
    ensure!(
        setup.interface.inertia == InertiaSide::Link,
        "{name}: interface.inertia is \"motor\": a Franka reports that of its links"
    );
    for (max, unit) in setup.limits.external_max.into_iter().zip(["N", "Nm"]) {
        ensure!(
            max < COLLISION_MAX,
            "{name}: limits.external_max has {max} {unit}: below {COLLISION_MAX} would be right, where the robot itself stops"
        );
    }
    setup.arm.torque_rate_max = setup.arm.torque_rate_max.map(|rate| RATE_SHARE * rate);
    Ok(setup)
}

/// The joint angles (rad) to start from, which the arm must reach.
fn within(start: &[f64], arm: &Arm) -> Result<[f64; 7]> {
    for (joint, (angle, [low, high])) in start.iter().zip(arm.range).enumerate() {
        ensure!((low..=high).contains(angle), "--start, joint {}: {angle} rad; allowed: {low} to {high}", joint + 1);
    }
    start.try_into().context("--start takes seven angles")
}

/// The set-up's joint ranges must lie within those of the robot, whose generation its protocol tells.
fn check_range(arm: &Arm, version: FciVersion) -> Result<()> {
    let (name, robot) = match version {
        FciVersion::V5 => ("panda", Arm::PANDA),
        FciVersion::V10 => ("fr3", Arm::FR3),
    };
    for (joint, (ours, robots)) in arm.range.iter().zip(robot.range).enumerate() {
        ensure!(
            ours[0] >= robots[0] && ours[1] <= robots[1],
            "arm.range of joint {}: {} to {} rad; the robot ({name}) goes from {} to {}",
            joint + 1,
            ours[0],
            ours[1],
            robots[0],
            robots[1]
        );
    }
    Ok(())
}

/// The robot's own settings: its stops beyond ours, its wrench about the tool point.
fn prepare(robot: &Robot, setup: &HostSetup) -> Result<()> {
    if robot.read_once()?.robot_mode == RobotMode::Reflex {
        println!("the robot has stopped in a reflex: recovering");
        robot.automatic_error_recovery()?;
    }
    let [force, moment] = setup.limits.external_max.map(|max| (COLLISION_MARGIN * max).min(COLLISION_MAX));
    let forces = [force, force, force, moment, moment, moment];
    robot.set_collision_behavior_simple(COLLISION_TORQUE, COLLISION_TORQUE, forces, forces)?;
    robot.set_k(IDENTITY)?;
    Ok(())
}

/// The loop at 1 kHz.
struct Act<'a> {
    setup: &'a HostSetup,
    /// The set-up's, of length 1.
    contact_axis: Vector3,
    host: Host,
    source: Source,
    /// The policy's first action, which came before the loop.
    first: Option<Vec<f64>>,
    log: Option<Log>,
    stop: Arc<AtomicBool>,
    /// Longest time (s).
    duration: f64,
    /// Why the policy's latest answer was not taken.
    refused: Option<anyhow::Error>,
}

impl Act<'_> {
    fn control(&mut self, robot: &Robot, model: &Model, read: &dyn Fn(&RobotState) -> ArmState) -> Result<()> {
        let mut control = robot.start_torque_control()?;
        let (mut energy, mut control_energy) = (EnergyLedger::default(), EnergyLedger::default());
        let (mut time, mut next_action, mut cycles) = (0.0, 0.0, 0u64);
        let (mut lost, mut last_qd) = (0u64, None::<JointVector>);
        let outcome = loop {
            let (state, period) = control.read_once().context("the robot has stopped")?;
            let arm = read(&state);
            let dt = if last_qd.is_some() { period.as_secs_f64() } else { 0.0 };
            if last_qd.is_none() {
                // From where the arm is now, with the torque that it has now.
                self.host.start(&arm, &model_pose(&state, model)).map_err(|fault| anyhow!("{fault}: refused"))?;
            }
            // Of the torque that has acted since the last cycle.
            let qd = 0.5 * (last_qd.replace(arm.qd).unwrap_or(arm.qd) + arm.qd);
            let law_coriolis =
                if self.setup.interface.coriolis == CompensatedBy::Law { arm.coriolis } else { JointVector::zeros() };
            energy.add(&(arm.tau + arm.gravity), &qd, &Arm::FRANKA_DRIVES, dt);
            control_energy.add(&(arm.tau - law_coriolis), &qd, &Arm::FRANKA_DRIVES, dt);
            time += dt;
            cycles += 1;
            lost += (dt / self.setup.controller.dt()).round().max(1.0) as u64 - 1;
            let command = self.host.update(&arm, dt);
            let tau = Torques::new(command.tau.into());
            if let Some(log) = &self.log
                && cycles.is_multiple_of(LOGGED)
                && let Some(row) =
                    Row::new(time, self.phase(), &self.host, &command, [&energy, &control_energy], &self.contact_axis)
            {
                log.add(row);
            }
            if self.host.is_relaxed() {
                control.write_once(&motion_finished(tau))?;
                break command.status;
            }
            control.write_once(&tau).context("the robot has stopped")?;
            // Behind the torque: what takes time takes it from the next cycle's wait.
            if time >= next_action {
                next_action += 1.0 / f64::from(self.setup.controller.policy_hz);
                self.ask();
            }
            self.answer();
            if self.stop.load(Ordering::Relaxed) || time > self.duration {
                self.host.stop();
            }
        };
        println!(
            "{time:.1} s, {cycles} cycles, {lost} lost, {:.2} J, tank {:.2} J",
            control_energy.absolute,
            self.host.tank()
        );
        match outcome {
            Status::Fault(fault) => Err(anyhow!("{fault}: the arm held its posture, relaxed, and was let go")),
            _ => self.refused.take().map_or(Ok(()), Err),
        }
    }

    fn phase(&self) -> &'static str {
        match &self.source {
            Source::Script(script) => script.phase(),
            Source::Policy(_) => "policy",
        }
    }

    /// At the policy's rate.
    fn ask(&mut self) {
        match &mut self.source {
            Source::Script(script) => match script.action(&self.host, self.setup) {
                Some(action) => {
                    let _ = self.host.set_goal(&action); // After a fault nobody listens.
                }
                None => self.host.stop(),
            },
            Source::Policy(policy) => policy.ask(&self.host),
        }
    }

    /// At each cycle. A policy that answers nonsense is ended as one that is told to stop.
    fn answer(&mut self) {
        let Source::Policy(policy) = &mut self.source else { return };
        let answer = self.first.take().map_or_else(|| policy.answer(), |first| Ok(Some(first)));
        let refused = match answer {
            Ok(Some(action)) => match self.host.set_goal(&action) {
                Ok(()) | Err(NotTaken::NotRunning) => return,
                Err(error) => anyhow!(error),
            },
            Ok(None) => return,
            Err(error) => error,
        };
        self.refused.get_or_insert(refused);
        self.host.stop();
    }
}
