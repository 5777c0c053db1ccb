//! The whole program: set-up, connection, checks, and episodes one after the other.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use aforce::host::{ArmInterface, CompensatedBy, Host, HostSetup, InertiaSide, WrenchSource, contact_axis};
use aforce::{Arm, Vector3};
use anyhow::{Context, Result, anyhow, ensure};
use franka::{FciVersion, RealtimeConfig, Robot, RobotMode, RobotState};
use signal_hook::consts::{SIGINT, SIGTERM};

use crate::arm::{arm_state, now};
use crate::cli::{Args, Script};
use crate::csv_log::Log;
use crate::episode::{Act, Source};
use crate::gripper::Hand;
use crate::policy::Policy;
use crate::protocol::Expected;
use crate::rehearsal::add_table;
use crate::robot_setup::{COLLISION_MAX, RobotSetup};
use crate::script::Running;
use crate::{checks, memory, motion};

/// Share of the torque-rate limit that the host uses: the robot refuses 1000 Nm/s, and compares in single precision.
const RATE_SHARE: f64 = 0.99;
const IDENTITY: [f64; 16] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Runs the program.
pub fn run(args: &Args) -> Result<()> {
    let (setup, own) = read_setup(args)?;
    let host = Host::new(&setup)?;
    check_arguments(args, &setup)?;
    memory::lock(!args.no_realtime)?;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    // Threads and processes that start after the connection would inherit the real-time priority of the control thread.
    let log = args.log.as_deref().map(Log::create).transpose()?;
    let outcome = with_robot(args, &setup, &own, host, &stop, log.as_ref());
    let lost = log.map_or(Ok(0), Log::finish);
    if let Ok(rows @ 1..) = lost {
        eprintln!("note: the log lacks {rows} rows, which the disk was too slow to take");
    }
    if let (Err(_), Err(lost)) = (&outcome, &lost) {
        eprintln!("error: {lost:#}");
    }
    outcome.and(lost.map(drop))
}

fn with_robot(
    args: &Args,
    setup: &HostSetup,
    own: &RobotSetup,
    host: Host,
    stop: &Arc<AtomicBool>,
    log: Option<&Log>,
) -> Result<()> {
    let expected = Expected::new(&setup.space, own.gripper.is_some())?;
    let policy = args.policy.as_deref().map(|command| Policy::start(command, expected)).transpose()?;
    let hand = own.gripper.map(|gripper| Hand::connect(&args.robot, gripper)).transpose()?;
    let realtime = if args.no_realtime { RealtimeConfig::Ignore } else { RealtimeConfig::Enforce };
    let robot = Robot::new(&args.robot, realtime).with_context(|| format!("--robot {}", args.robot))?;
    println!("connected: {:?}, {:?}", args.robot, robot.fci_version());
    check_arm(&setup.arm, robot.fci_version())?;
    prepare(&robot, setup, own)?;
    let model = robot.load_model().context("the robot's model")?;
    if let Some(start) = args.start.as_deref() {
        motion::move_to(&robot, within(start, &setup.arm)?, stop).context("the move to the start")?;
        checks::go_on(stop)?;
    }
    if !args.no_push_check {
        checks::push_by_hand(&robot, &model, setup, stop)?;
    }

    let read = |state: &RobotState| {
        let mut arm = arm_state(state, &model);
        if let Some(height) = args.rehearse_table {
            add_table(&mut arm, height, setup.interface.wrench_sign);
        }
        arm
    };
    let state = now(&robot)?;
    let source = match (policy, args.script) {
        (Some(policy), _) => Source::Policy(policy),
        (None, Some(script)) => Source::Script(Running::new(script, read(&state).pose)),
        (None, None) => return Err(anyhow!("--script or --policy")),
    };
    let mut act = Act {
        robot: &robot,
        model: &model,
        read: &read,
        setup,
        contact_axis: contact_axis(setup.contact_axis)?.into_inner(),
        host,
        source,
        hand,
        log,
        stop: Arc::clone(stop),
        duration: args.duration,
        home: state.q,
        episode: 1,
        ended: None,
    };
    // Everything that can be refused is refused before a torque flows.
    act.get_ready(false)?.map_err(|reason| anyhow!(reason))?;
    act.episodes()
}

/// Refuses arguments that are out of range or contradict the set-up.
fn check_arguments(args: &Args, setup: &HostSetup) -> Result<()> {
    ensure!(args.duration > 0.0, "--duration {}: must be above 0", args.duration);
    ensure!(
        args.rehearse_table.is_none_or(f64::is_finite),
        "--rehearse-table {}: must be a height in metres",
        args.rehearse_table.unwrap_or_default()
    );
    let wipes = args.script == Some(Script::Wipe);
    ensure!(!wipes || setup.space.force, "--script wipe presses: `{}` has space.force = false", setup.space);
    let reported = setup.interface.wrench == WrenchSource::Reported;
    ensure!(
        reported || args.no_push_check,
        "interface.wrench is observed: a push shows what the arm reports, which the law does not read; --no-push-check"
    );
    ensure!(
        args.rehearse_table.is_none() || reported,
        "--rehearse-table adds to a wrench that the arm reports: interface.wrench is observed, \"reported\" would be right"
    );
    let up = (contact_axis(setup.contact_axis)?.into_inner() - Vector3::z()).norm() < 1e-6;
    for (option, given) in [("--script wipe", wipes), ("--rehearse-table", args.rehearse_table.is_some())] {
        ensure!(
            !given || up,
            "{option} has its table below: contact_axis is {:?}, [0.0, 0.0, 1.0] would be right",
            setup.contact_axis
        );
    }
    args.start.as_deref().map_or(Ok(()), |start| within(start, &setup.arm).map(|_| ()))
}

fn read_setup(args: &Args) -> Result<(HostSetup, RobotSetup)> {
    let (name, text) = match &args.setup {
        Some(path) => {
            let name = path.display().to_string();
            (name.clone(), std::fs::read_to_string(path).with_context(|| name)?)
        }
        None => ("configs/fr3.toml".to_owned(), include_str!("../configs/fr3.toml").to_owned()),
    };
    let (own, text) = RobotSetup::cut_out(&text).map_err(|error| anyhow!("{name}: {error}"))?;
    let mut setup = HostSetup::from_toml(&text).map_err(|error| anyhow!("{name}: {error}"))?;
    ensure!(setup.controller.control_hz == 1000, "{name}: controller.control_hz must be 1000, the arm's rate");
    ensure!(
        setup.interface.gravity == CompensatedBy::Arm,
        "{name}: interface.gravity is \"law\": a Franka compensates gravity itself, twice would throw it up; \
         interface = \"franka\", or {{ extends = \"franka\", .. }}"
    );
    ensure!(
        setup.interface.coriolis == CompensatedBy::Law,
        "{name}: interface.coriolis is \"arm\": a Franka leaves Coriolis forces to whoever commands its torques, \"law\" \
         would be right"
    );
    ensure!(
        setup.interface.inertia == InertiaSide::Link,
        "{name}: interface.inertia is \"motor\": a Franka reports that of its links"
    );
    check_wrench(&setup.interface).map_err(|error| anyhow!("{name}: {error}"))?;
    for (max, unit) in setup.limits.external_max.into_iter().zip(["N", "Nm"]) {
        ensure!(
            max < COLLISION_MAX,
            "{name}: limits.external_max has {max} {unit}: below {COLLISION_MAX} would be right, where the robot itself stops"
        );
    }
    setup.arm.torque_rate_max = setup.arm.torque_rate_max.map(|rate| RATE_SHARE * rate);
    Ok((setup, own))
}

/// Refuses conventions of a reported wrench that are not a Franka's. Those of an observed one are not read.
fn check_wrench(interface: &ArmInterface) -> Result<()> {
    const FRANKA: ArmInterface = ArmInterface::FRANKA;
    if interface.wrench != WrenchSource::Reported {
        return Ok(());
    }
    ensure!(
        interface.wrench_sign == FRANKA.wrench_sign,
        "interface.wrench_sign is \"on-tool\": a Franka reports what the tool exerts, \"on-environment\" would be right"
    );
    ensure!(
        interface.wrench_axes == FRANKA.wrench_axes,
        "interface.wrench_axes is \"tool\": a Franka reports the wrench in the axes of its base, \"base\" would be right"
    );
    ensure!(
        interface.wrench_point == FRANKA.wrench_point,
        "interface.wrench_point is {:?}: franka-host has the moment reported about the tool point, {:?} would be right",
        interface.wrench_point,
        FRANKA.wrench_point
    );
    Ok(())
}

/// The joint angles of `--start` (rad), which must be within the arm's ranges.
fn within(start: &[f64], arm: &Arm) -> Result<[f64; 7]> {
    for (joint, (angle, [low, high])) in start.iter().zip(arm.range).enumerate() {
        ensure!((low..=high).contains(angle), "--start, joint {}: {angle} rad; allowed: {low} to {high}", joint + 1);
    }
    start.try_into().context("--start takes seven angles")
}

/// Refuses a set-up whose arm exceeds the limits of the connected robot. The protocol's version tells a Panda from an FR3.
fn check_arm(arm: &Arm, version: FciVersion) -> Result<()> {
    let (name, robot) = match version {
        FciVersion::V5 => ("panda", Arm::PANDA),
        FciVersion::V10 => ("fr3", Arm::FR3),
    };
    arm.stays_within(&robot).map_err(|error| anyhow!("{}; the robot is of the kind {name}", error.below("arm")))
}

/// Clears a reflex and sends the robot's own settings. The wrench that the robot reports is about the tool point.
fn prepare(robot: &Robot, setup: &HostSetup, own: &RobotSetup) -> Result<()> {
    if now(robot)?.robot_mode == RobotMode::Reflex {
        println!("the robot has stopped in a reflex: recovering");
        robot.automatic_error_recovery()?;
    }
    own.apply(robot, setup.limits.external_max)?;
    robot.set_k(IDENTITY)?;
    Ok(())
}
