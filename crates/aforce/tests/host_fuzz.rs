//! Two million cycles with random and broken states: no panic, and every torque finite, within the limits of the arm and of their rate
//! relative to the torque that the arm took.

mod arm;

use aforce::host::{ArmInterface, ArmState, Host, HostLimits, HostSetup, Status, TankConfig, WrenchSource};
use aforce::{
    ActionSpace, Arm, ControllerConfig, Interpolation, Jacobian, JointMatrix, JointVector, Pose, Vector3, Wrench,
};
use arm::{BallArm, HOME};
use nalgebra::{Quaternion, UnitQuaternion};

const CYCLES: usize = 2_000_000;

/// A stream of numbers (splitmix64).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [-1, 1].
    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.bits().is_multiple_of(n)
    }

    /// A number that no sensor should send, and now and then any bit pattern at all.
    fn odd(&mut self) -> f64 {
        const ODD: [f64; 12] = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN_POSITIVE,
            1e300,
            -1e9,
            9.9e3,
            -9.9e3,
            0.0,
            -0.0,
            5e-324,
        ];
        let choice = self.bits() as usize % (ODD.len() + 2);
        ODD.get(choice).copied().unwrap_or_else(|| f64::from_bits(self.bits()))
    }
}

fn usual() -> ArmState {
    let jacobian = Jacobian::from_fn(|i, j| if i == j { 1.0 } else { 0.1 * (i as f64 - 0.7 * j as f64).sin() });
    let root = JointMatrix::from_fn(|i, j| 0.2 * (i as f64 + 2.0 * j as f64).cos());
    ArmState {
        q: JointVector::from([0.0, 0.2, 0.0, -2.0, 0.0, 2.2, 0.8]),
        qd: JointVector::repeat(0.01),
        pose: Pose::new(Vector3::new(0.5, 0.0, 0.3), Vector3::new(3.1, 0.1, 0.0)),
        jacobian,
        mass: root * root.transpose() + JointMatrix::identity(),
        gravity: JointVector::repeat(1.0),
        coriolis: JointVector::repeat(0.1),
        wrench: Wrench::new(0.0, 0.0, 10.0, 0.0, 0.0, 0.0),
        tau: JointVector::zeros(),
    }
}

/// The state of a moving arm, rarely spoilt.
fn moving(random: &mut Random, arm: &BallArm) -> ArmState {
    let mut state = arm.state();
    let odd = random.odd();
    let entry = random.bits() as usize;
    match random.bits() % 2000 {
        0 => state.mass = state.mass.upper_triangle(),
        1 => state.jacobian.swap_rows(0, 3),
        2 => state.q[entry % 7] += 0.1,
        3 => state.pose.translation.vector[entry % 3] += 0.1,
        4 => state.coriolis[entry % 7] += 20.0,
        5 => state.mass.fill(0.0),
        6 => state.jacobian[entry % 42] = odd,
        _ => {}
    }
    state
}

/// The usual state, disturbed: a little, much, singular, or beyond reading.
fn state(random: &mut Random) -> ArmState {
    let mut state = usual();
    let scale: f64 = [1e-3, 0.1, 1.0, 1e3][random.bits() as usize % 4];
    state.q += JointVector::from_fn(|_, _| scale.min(0.2) * random.unit());
    state.qd += JointVector::from_fn(|_, _| scale * random.unit());
    state.wrench += Wrench::from_fn(|_, _| scale * random.unit());
    state.pose.translation.vector += Vector3::from_fn(|_, _| scale.min(0.1) * random.unit());
    let turn = Vector3::from_fn(|_, _| 3.0 * scale * random.unit());
    state.pose.rotation = UnitQuaternion::from_scaled_axis(turn) * state.pose.rotation;
    state.coriolis += JointVector::from_fn(|_, _| scale * random.unit());
    match random.bits() % 40 {
        0 => state.jacobian.row_mut(random.bits() as usize % 6).fill(0.0), // Singular.
        1 => state.jacobian.fill(0.0),
        2 => state.jacobian *= 1e3,
        3 => state.mass *= 1e-9,
        4 => state.mass *= 1e3,
        5 => state.mass = -state.mass,
        6 => state.mass.fill(1.0),                      // Of rank 1.
        7 => state.mass[(0, 3)] += 5.0 * random.unit(), // Not symmetric.
        8 => state.pose.rotation = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 0.0, 0.0, 0.0)),
        9 => {
            let odd = random.odd();
            let entry = random.bits() as usize;
            match random.bits() % 7 {
                0 => state.q[entry % 7] = odd,
                1 => state.qd[entry % 7] = odd,
                2 => state.jacobian[entry % 42] = odd,
                3 => state.mass[entry % 49] = odd,
                4 => state.wrench[entry % 6] = odd,
                5 => state.pose.translation.vector[entry % 3] = odd,
                _ => state.coriolis[entry % 7] = odd,
            }
        }
        _ => {}
    }
    state
}

fn hosts() -> Vec<Host> {
    const FREE: f64 = f64::INFINITY;
    // Bounds so wide that most spoilt states reach the law itself.
    let wide = HostLimits {
        silence_max: FREE,
        error_max: [FREE; 2],
        wrench_max: [FREE; 2],
        external_max: [FREE; 2],
        workspace: [[-FREE; 3], [FREE; 3]],
        tank: TankConfig { initial: FREE, capacity: FREE, low: 0.0 },
        disagreement_max: FREE,
        ..HostLimits::default()
    };
    // Parts of a random state never agree with each other. Uncompared, such states reach the law and the usual bounds.
    let narrow = HostLimits { disagreement_max: FREE, ..HostLimits::default() };
    let mut hosts = Vec::new();
    for name in ["aforce-force", "aforce-psi", "variable-force", "osc", "low", "aforce-shaped-force"] {
        for limits in [narrow, wide, HostLimits::default()] {
            let mut space: ActionSpace = name.parse().unwrap();
            if let aforce::Stiffness::Adaptive(psi) = &mut space.stiffness {
                psi.anti_windup = true;
            }
            let arm = if limits == wide {
                Arm { range: [[-100.0, 100.0]; 7], speed_max: [1e4; 7], ..Arm::PANDA }
            } else {
                Arm::PANDA
            };
            let mut controller = ControllerConfig {
                control_hz: 1000,
                interpolation: Interpolation::JerkLimited { dynamics: 0.3 },
                ..ControllerConfig::default()
            };
            (controller.force.kd, controller.force.force_max) = (0.01, 30.0);
            let interface = ArmInterface {
                wrench: if limits == narrow {
                    WrenchSource::Observed { cutoff_hz: 25.0 }
                } else {
                    WrenchSource::Reported
                },
                ..ArmInterface::FRANKA
            };
            let setup = HostSetup { contact_axis: [0.0, 0.0, 1.0], arm, interface, limits, controller, space };
            hosts.push(Host::new(&setup).unwrap());
        }
    }
    hosts
}

#[test]
fn whatever_is_measured_the_torque_is_one_that_the_arm_takes() {
    let mut random = Random(28);
    let mut hosts = hosts();
    let cycles = CYCLES / hosts.len();
    let (mut running, mut faults) = (0u32, [0u32; 22]);
    for (number, host) in hosts.iter_mut().enumerate() {
        let moves = number % 3 == 2;
        let mut arm = BallArm::at(HOME, ArmInterface::FRANKA);
        let (mut last, mut since_fault) = (None::<JointVector>, 0);
        for cycle in 0..cycles {
            let state = if moves { moving(&mut random, &arm) } else { state(&mut random) };
            // Now and then the arm reports a torque that it cannot have taken: the rate is then limited relative to the torque that was
            // sent last.
            let strange = random.one_in(100);
            let nonsense = [f64::NAN, f64::NEG_INFINITY, 9.9e3, -99.0][random.bits() as usize % 4];
            let state = ArmState { tau: if strange { JointVector::repeat(nonsense) } else { arm.tau }, ..state };
            let dt = match random.bits() % if moves { 1024 } else { 64 } {
                0 => 0.0,
                1 => random.odd(),
                2 => -0.001,
                3..12 if !moves => 0.01 * (random.unit() + 1.0),
                _ => 0.001,
            };
            if cycle % 20 == 0 || random.one_in(50) {
                let mut action = [0.0; 20];
                action.fill_with(|| if random.one_in(30) { random.odd() } else { random.unit() });
                let length = if random.one_in(40) { 20 } else { host.controller().space().dim() };
                let _ = host.set_goal(&action[..length]);
            }
            let command = host.update(&state, dt);
            assert!(command.tau.iter().all(|tau| tau.is_finite()), "{:?}", command.status);
            // A `dt` that cannot be a period counts as the nominal one.
            let step = if dt >= 0.0 { dt.min(0.001) } else { 0.001 };
            for joint in 0..7 {
                assert!(command.tau[joint].abs() <= Arm::PANDA.torque_max[joint]);
                let from = if strange { last } else { Some(arm.tau) };
                let jump = from.map_or(0.0, |from| (command.tau[joint] - from[joint]).abs());
                assert!(jump <= 1000.0 * step + 1e-9, "{jump} Nm in {dt} s, {:?}", command.status);
            }
            assert!(host.tank() >= 0.0);
            last = Some(command.tau);
            // A tenth of the commands is lost.
            if !random.one_in(10) {
                arm.tau = command.tau;
            }
            if moves {
                arm.advance(0.001);
            }
            match command.status {
                Status::Fault(fault) => {
                    assert!(!fault.to_string().is_empty());
                    faults[fault.code() as usize] += u32::from(since_fault == 0);
                    since_fault += 1;
                }
                Status::Stopped => {}
                Status::Running | Status::Limited(_) => running += 1,
            }
            // Start again from the torque that acts on the arm; sometimes with a nonsensical state, which is refused.
            if !matches!(command.status, Status::Running | Status::Limited(_)) && (since_fault > 5 || cycle == 0) {
                if moves && since_fault > 5 {
                    arm = BallArm { tau: arm.tau, ..BallArm::at(HOME, ArmInterface::FRANKA) };
                }
                let mut start = if moves {
                    arm.state()
                } else if random.one_in(4) {
                    state
                } else {
                    usual()
                };
                start.tau = arm.tau;
                if host.start(&start, &start.pose).is_ok() {
                    last = Some(arm.tau);
                }
                since_fault = 0;
            }
        }
    }
    println!("{running} cycles of the law; faults by code {faults:?}");
    assert!(running as usize > CYCLES / 4, "{running}");
    for code in [1, 2, 3, 5, 6, 11, 12, 13, 14, 15, 18] {
        assert!(faults[code] > 0, "fault {code} was not met: {faults:?}");
    }
}
