use super::*;
use crate::host::interface::WrenchSource;

const FILE: &str = "arm = 'fr3'\ninterface = 'franka'\nspace = 'aforce-force'\n[controller]\ncontrol_hz = 1000\n";

fn error(text: &str) -> String {
    HostSetup::from_toml(text).unwrap_err().to_string()
}

#[test]
fn a_short_file_and_the_whole_one() {
    let short = HostSetup::from_toml(FILE).unwrap();
    assert_eq!((short.arm, short.interface), (Arm::FR3, ArmInterface::FRANKA));
    assert_eq!((short.limits, short.contact_axis), (HostLimits::default(), [0.0, 0.0, 1.0]));
    let whole = toml::to_string(&short).unwrap();
    assert_eq!(HostSetup::from_toml(&whole).unwrap(), short, "{whole}");
    let own = FILE.replace("'aforce-force'", "{ extends = 'aforce', name = 'soft', stiffness.fixed = 200 }");
    assert_eq!(HostSetup::from_toml(&own).unwrap().space.name, "soft");
    let sensorless = FILE.replace("'franka'", "{ extends = 'plain', wrench.observed.cutoff_hz = 25 }");
    let observed = WrenchSource::Observed { cutoff_hz: 25.0 };
    assert_eq!(
        HostSetup::from_toml(&sensorless).unwrap().interface,
        ArmInterface { wrench: observed, ..ArmInterface::PLAIN }
    );
}

#[test]
fn what_is_not_said_is_gentle() {
    let two_lines = HostSetup::from_toml("arm = 'fr3'\ninterface = 'franka'").unwrap();
    let ControllerConfig { control_hz, position_step, interpolation, .. } = two_lines.controller;
    assert_eq!((control_hz, position_step), (1000, 0.02));
    assert_eq!((two_lines.controller.force.force_max, two_lines.controller.force.ki), (30.0, 16.0));
    assert_eq!(interpolation, Interpolation::JerkLimited { dynamics: 0.1 });
    let psi = two_lines.space.psi().unwrap();
    assert_eq!((psi.k_max.vector().max(), two_lines.space.force), (1500.0, true));
    // A key replaces only its own default.
    let faster = HostSetup::from_toml(&format!("{FILE}position_step = 0.03")).unwrap();
    assert_eq!((faster.controller.position_step, faster.controller.rotation_step), (0.03, 0.15));
    assert_eq!(faster.space, "aforce-force".parse().unwrap());
}

#[test]
fn a_force_that_would_be_a_fault_or_would_swing_is_refused() {
    let told = |lines: &str| error(&format!("{FILE}{lines}"));
    assert_eq!(
        told("force.force_max = 41"),
        "controller.force.force_max: 41 N is above 0.8 of limits.external_max, 50 N, where a push is a fault: \
         lower the one or raise the other"
    );
    assert!(told("[limits]\nexternal_max = [35, 20]").starts_with("controller.force.force_max: 30 N is above"));
    assert_eq!(
        told("force.ki = 26"),
        "controller.force.ki: 26 1/s would swing against a stiff wall: below (1 + kp) damping_rate_min = 26 1/s \
         would be right"
    );
    assert!(told("force.damping_rate_min = 0").starts_with("controller.force.ki: 16 1/s would swing"));
    let unforced = FILE.replace("aforce-force", "aforce");
    for allowed in [
        format!("{FILE}force.force_max = 40\nforce.ki = 25"),
        format!("{FILE}force.force_max = 60\n[limits]\nexternal_max = [inf, 20]"),
        format!("{FILE}force.ki = 0\nforce.damping_rate_min = 0"),
        format!("{unforced}force.force_max = 60\nforce.ki = 30"),
    ] {
        HostSetup::from_toml(&allowed).unwrap();
    }
}

/// Stiffness that adapts has its own limit of stability. Nothing else says that a fixed or a commanded one is damped.
#[test]
fn a_stiffness_that_swings_is_refused() {
    let with = |space: &str| HostSetup::from_toml(&FILE.replace("'aforce-force'", space)).map(drop);
    for base in ["high", "low-force", "variable", "osc"] {
        for (ratio, axis, value) in [("0.0", "x", "0"), ("[1.0, 0.29]", "rx", "0.29")] {
            let told = with(&format!("{{ extends = '{base}', damping_ratio = {ratio} }}")).unwrap_err().to_string();
            let allowed = "is not allowed; allowed: 0.3 to 10";
            assert_eq!(told, format!("space.damping_ratio (axis {axis}) = {value} {allowed}"), "{base}");
        }
        with(&format!("{{ extends = '{base}', damping_ratio = 0.3 }}")).unwrap();
    }
    with("{ extends = 'aforce', damping_ratio = 0.2, stiffness.adaptive.allow_unstable = true }").unwrap();
}

/// An arm that does not say its rotors, as a six-joint arm's seventh joint.
#[test]
fn a_hold_of_unknown_inertia_is_damped() {
    let arm = FILE.replace("'fr3'", "{ extends = 'fr3', rotor_inertia = [0, 0, 0, 0, 0, 0, 0] }");
    HostSetup::from_toml(&arm).unwrap();
    let with = |lines: &str| HostSetup::from_toml(&format!("{arm}[limits.hold]\n{lines}")).map(drop);
    let told = with("damping = [10, 10, 10, 10, 3, 0, 2]").unwrap_err().to_string();
    assert_eq!(told, "limits.hold.damping (joint 6) = 0 is not allowed; allowed: above 0");
    with("damping = [0, 0, 0, 0, 0, 0, 0]\nstiffness = [0, 0, 0, 0, 0, 0, 0]\nrelaxed = [0, 0, 0, 0, 0, 0, 0]")
        .unwrap();
}

#[test]
fn a_contact_axis_has_any_length_and_a_direction() {
    for short_or_long in [1e-8, 1.0, 1e8] {
        assert_eq!(contact_axis([0.0, 0.0, short_or_long]).unwrap(), Vector3::z_axis());
    }
    for none in [[0.0; 3], [0.0, 0.0, 1e200], [f64::INFINITY, 0.0, 1.0], [f64::NAN, 0.0, 1.0]] {
        let told = contact_axis(none).unwrap_err().to_string();
        assert_eq!(told, format!("contact_axis: {none:?} has no direction"));
    }
}

#[test]
fn what_is_wrong_is_told() {
    assert!(error("x").starts_with("line 1, column 2: key with no value"), "{}", error("x"));
    let text = error(&format!("{FILE}[limits]\nsilence_max = 'long'"));
    assert!(text.starts_with("line 7, column 1: limits.silence_max: invalid type: string \"long\""), "{text}");
    assert_eq!(
        error(&FILE.replace("'fr3'", "'fr4'")),
        "arm = \"fr4\": known are panda, fr3, or a table that extends one"
    );
    assert!(error(&FILE.replace("'franka'", "{ extends = 'frank' }")).starts_with("interface = \"frank\": known are"));
    assert!(error(&FILE.replace("aforce-force", "aforse")).starts_with("space: unknown action space `aforse`"));
    assert_eq!(
        error(&FILE.replace("control_hz", "control_khz")),
        "line 5, column 1: unknown key \"controller.control_khz\"; did you mean \"controller.control_hz\"?"
    );
    assert!(
        error(&format!("{FILE}[limits]\nwrench_max = [0.0, 1.0]"))
            .starts_with("limits.wrench_max = 0 is not allowed; allowed: above 0, at most inf")
    );
    let workspace = format!("{FILE}[limits]\nworkspace = [[0.5, 0.0, 0.0], [0.4, 1.0, 1.0]]");
    assert!(error(&workspace).starts_with("limits.workspace (upper corner) = 0.4"), "{}", error(&workspace));
    assert_eq!(
        error(&format!("contact_axis = [0.0, 0.0, 0.0]\n{FILE}")),
        "contact_axis: [0.0, 0.0, 0.0] has no direction"
    );
    let winding = FILE.replace("'aforce-force'", "{ extends = 'aforce', stiffness.adaptive.anti_windup = false }");
    assert!(error(&winding).starts_with("space.stiffness.adaptive.anti_windup: false"), "{}", error(&winding));
    // Limits beyond the arm's, and a hold that swings.
    let limits = |line: &str| error(&format!("{FILE}[limits]\n{line}"));
    assert_eq!(limits("joint_margin = 5"), "limits.joint_margin = 5 is not allowed; allowed: 0 to 0.722575");
    assert_eq!(limits("wrench_max = [1e9, 50]"), "limits.wrench_max = 1000000000 is not allowed; allowed: 0 to 348");
    assert_eq!(limits("wrench_max = [100, 88]"), "limits.wrench_max = 88 is not allowed; allowed: 0 to 87");
    let undamped = limits("hold.damping = [10, 0, 10, 10, 3, 2.5, 2]");
    assert!(undamped.starts_with("limits.hold.damping (joint 2) = 0 is not allowed; allowed: 3.6"), "{undamped}");
    let stiff = limits("hold.stiffness = [1e4, 60, 60, 60, 20, 15, 10]");
    assert!(stiff.starts_with("limits.hold.stiffness (joint 1) = 10000 is not allowed; allowed: 0 to 1000"), "{stiff}");
    for (key, told) in [
        (
            "torque_max = [500, 87, 87, 87, 12, 12, 12]",
            "arm.torque_max (joint 1) = 500 is not allowed; allowed: 0 to 87",
        ),
        (
            "torque_rate_max = [1000, 1e5, 1000, 1000, 1000, 1000, 1000]",
            "arm.torque_rate_max (joint 2) = 100000 is not",
        ),
        ("speed_max = [2, 2, 2, 2, 2, 2, 9]", "arm.speed_max (joint 7) = 9 is not allowed; allowed: 0 to 5.26"),
    ] {
        let text = error(&FILE.replace("'fr3'", &format!("{{ extends = 'fr3', {key} }}")));
        assert!(text.starts_with(told), "{text}");
    }
    let jumps = error(&FILE.replace("aforce-force", "robosuite-osc"));
    assert_eq!(jumps, "space.set_point: \"jump\": on an arm a set-point moves, \"interpolated\" would be right");
    // A set-point that is faster than the tool may be.
    let ramp = |lines: &str| error(&format!("{FILE}interpolation.linear.ramp_ratio = 0.5\n{lines}"));
    assert_eq!(ramp("position_step = 0.1"), "controller.position_step = 0.1 is not allowed; allowed: 0 to 0.0433");
    assert_eq!(ramp(""), "controller.rotation_step = 0.15 is not allowed; allowed: 0 to 0.036");
    let far = FILE.replace("'aforce-force'", "{ extends = 'aforce', name = 'far', goal.absolute = { reach_position = 0.5, reach_rotation = 0.5, leash_position = 0.05, leash_rotation = 0.2 } }");
    let told =
        error(&format!("{far}interpolation.linear.ramp_ratio = 0.5\nposition_step = 0.01\nrotation_step = 0.01"));
    assert!(told.starts_with("controller.interpolation: linear: an absolute goal"), "{told}");
    // Settings that would be a fault in every cycle or before every action, or that would overshoot.
    let slow = error(&FILE.replace("1000", "40"));
    assert!(slow.starts_with("controller.control_hz: a cycle of 0.025 s is longer than limits.period_max"), "{slow}");
    let mut jumps = HostSetup::from_toml(FILE).unwrap();
    jumps.arm.torque_rate_max[1] = f64::INFINITY;
    let told = jumps.validate().unwrap_err().to_string();
    assert!(told.starts_with("arm.torque_rate_max (joint 2) = inf is not allowed"), "{told}");
    let silent = error(&format!("{FILE}policy_hz = 2\n"));
    assert!(silent.starts_with("controller.policy_hz: an action in 0.5 s is silence"), "{silent}");
    let leaky = error(&FILE.replace("'aforce-force'", "{ extends = 'aforce', stiffness.adaptive.mu = 60 }"));
    assert!(leaky.starts_with("space.stiffness.adaptive.mu: 60 1/s would overshoot"), "{leaky}");
    let ranges = "{ hold = 1, ranges = [{ parameter = 'mu', low = 0.5, high = 60 }] }";
    let space = format!("{{ extends = 'aforce', name = 'leaky', commanded_psi = {ranges} }}");
    let leaky = error(&FILE.replace("'aforce-force'", &space));
    assert!(leaky.starts_with("space.commanded_psi.ranges[0].high: 60 1/s would overshoot"), "{leaky}");
}
