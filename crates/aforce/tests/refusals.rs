//! Every number of a host's set-up that is out of its range is refused with its name.

use aforce::host::HostSetup;

const FILE: &str = "arm = 'fr3'\ninterface = 'franka'\nspace = 'aforce-force'\n[controller]\ncontrol_hz = 1000\n";

fn refused(lines: &str) -> String {
    let text = format!("{FILE}{lines}");
    HostSetup::from_toml(&text).expect_err(&text).to_string()
}

#[test]
fn a_number_of_the_force_control_that_cannot_be_is_named() {
    for (key, value) in [
        ("force_max", "0"),
        ("kp", "-1"),
        ("ki", "-1"),
        ("kd", "nan"),
        ("integral_max", "-1"),
        ("command_rate_max", "0"),
        ("ramp_time", "0"),
        ("contact_on", "0"),
        ("contact_off", "99"),
        ("contact_hold", "-1"),
        ("engagement_time", "0"),
        ("damping_min", "-1"),
        ("damping_rate_min", "inf"),
    ] {
        let told = refused(&format!("force.{key} = {value}"));
        assert!(told.starts_with(&format!("controller.force.{key} = ")), "{key}: {told}");
    }
}

#[test]
fn a_limit_that_cannot_be_is_named() {
    for (key, value) in [
        ("period_max", "1"),
        ("silence_max", "0"),
        ("error_max", "[0, 1]"),
        ("wrench_rate_max", "[1, nan]"),
        ("external_max", "[-1, 1]"),
        ("kinematics_tolerance", "[0, 1]"),
        ("workspace_margin", "-1"),
        ("joint_margin", "-1"),
        ("joint_stiffness", "[0, 0, 0, 0, 0, 0, 2000]"),
        ("contact_loss", "0"),
        ("disagreement_max", "0.5"),
        ("tank.low", "-1"),
        ("tank.initial", "-1"),
        ("tank.capacity", "0.1"),
        ("hold.damping", "[-1, 1, 1, 1, 1, 1, 1]"),
    ] {
        let told = refused(&format!("[limits]\n{key} = {value}"));
        assert!(told.starts_with(&format!("limits.{key}")), "{key}: {told}");
    }
    let corner = refused("[limits]\nworkspace = [[nan, 0, 0], [1, 1, 1]]");
    assert!(corner.starts_with("limits.workspace (lower corner) = NaN"), "{corner}");
}

#[test]
fn a_set_up_with_a_part_that_is_none_is_refused() {
    let number = HostSetup::from_toml(&FILE.replace("'fr3'", "3")).unwrap_err().to_string();
    assert!(number.contains("arm") && number.contains("invalid type"), "{number}");
    let slow = HostSetup::from_toml(&FILE.replace("control_hz = 1000", "control_hz = 0")).unwrap_err().to_string();
    assert!(slow.starts_with("controller.control_hz = 0"), "{slow}");
    let arm = FILE.replace("'fr3'", "{ extends = 'fr3', torque_max = [-1, 1, 1, 1, 1, 1, 1] }");
    let arm = HostSetup::from_toml(&arm).unwrap_err().to_string();
    assert!(arm.starts_with("arm.torque_max (joint 1) = -1"), "{arm}");
    let point = FILE.replace("'franka'", "{ extends = 'franka', wrench_point = [2, 0, 0] }");
    let point = HostSetup::from_toml(&point).unwrap_err().to_string();
    assert!(point.starts_with("interface.wrench_point = 2"), "{point}");
}
