//! Force control: hand cases, anti-windup, bounds, and a closed loop against a wall.

use super::*;
use approx::assert_relative_eq;

const DT: f64 = 0.002;

fn push(force: f64) -> Wrench {
    Wrench::new(0.0, 0.0, force, 0.0, 0.0, 0.0)
}

fn control(config: ForceConfig) -> ForceControl {
    let mut control = ForceControl::new(config, Vector3::z());
    control.set_target(10.0);
    control
}

/// Feeds a constant measured force.
fn feed(control: &mut ForceControl, force: f64, samples: usize) {
    for _ in 0..samples {
        let before = control.command();
        control.update(&push(force), DT);
        assert!(control.command().abs() <= 50.0 && (control.command() - before).abs() <= 1000.0 * DT + 1e-9);
        assert!(control.integral.abs() <= 20.0);
    }
}

#[test]
fn nothing_happens_without_contact() {
    let mut control = control(ForceConfig::default());
    feed(&mut control, 3.0, 500);
    assert_eq!((control.command(), control.axis().engagement, control.in_contact()), (0.0, 0.0, false));
}

#[test]
fn proportional_part_by_hand() {
    let mut control = control(ForceConfig { ki: 0.0, ..ForceConfig::default() });
    feed(&mut control, 8.0, 500);
    // F_d + kp (F_d - F) = 10 + 0.3 (10 - 8)
    assert_relative_eq!(control.command(), 10.6, epsilon = 1e-9);
    assert_eq!(control.axis().engagement, 1.0);
    assert_eq!(control.update(&push(8.0), DT), push(10.6));
}

#[test]
fn integral_part_by_hand() {
    let mut control = control(ForceConfig { kp: 0.0, ..ForceConfig::default() });
    feed(&mut control, 10.0, 500);
    assert_relative_eq!(control.command(), 10.0, epsilon = 1e-9);
    // ki e t = 4 * 2 N * 1 s = 8 N; the last sample's share comes one sample later.
    feed(&mut control, 8.0, 501);
    assert_relative_eq!(control.command(), 18.0, epsilon = 1e-9);
}

#[test]
fn derivative_opposes_a_rising_force() {
    let config = ForceConfig { kp: 0.0, ki: 0.0, kd: 0.01, ..ForceConfig::default() };
    let mut control = control(config);
    feed(&mut control, 10.0, 500);
    feed(&mut control, 10.1, 1);
    // 10 - 0.01 s * 0.1 N / 2 ms
    assert_relative_eq!(control.command(), 9.5, epsilon = 1e-9);
}

/// The force jumps from 0 to 5 N in the sample in which contact begins; this jump must not count as a rate.
#[test]
fn the_derivative_does_not_kick_at_first_contact() {
    // Contact begins without delay, and the command follows at once.
    let config = ForceConfig { contact_hold: 0.0, command_rate_max: 1e6, ..ForceConfig::default() };
    let mut control = control(ForceConfig { kp: 0.0, ki: 0.0, kd: 0.01, ..config });
    control.update(&push(0.0), DT);
    control.update(&push(5.0), DT);
    // F_d alone, which begins at 5 N and has gone 2/80 of the way to 10 N; the rate of the jump would subtract 25 N.
    assert!(control.in_contact());
    assert_relative_eq!(control.command(), 5.125, epsilon = 1e-9);
}

#[test]
fn the_integral_does_not_wind_up() {
    let mut control = control(ForceConfig::default());
    control.set_target(50.0);
    // The wall gives way, so the force is never reached. The command saturates and the integral stays where it was.
    feed(&mut control, 5.0, 2000);
    assert_relative_eq!(control.command(), 50.0);
    let frozen = control.integral;
    assert!(frozen < 5.0, "{frozen}");
    // Too much force: the command comes down at once, not after the integral has been paid back.
    feed(&mut control, 80.0, 25);
    assert!(control.command() < 42.0);
}

#[test]
fn losing_contact_ends_the_command_and_forgets() {
    let mut control = control(ForceConfig::default());
    feed(&mut control, 8.0, 1000);
    assert!(control.integral > 1.0);
    feed(&mut control, 0.0, 5);
    assert!(!control.in_contact() && control.integral == 0.0 && control.desired() == 0.0);
    feed(&mut control, 0.0, 50);
    assert_eq!(control.command(), 0.0);
    assert_eq!(control.axis().engagement, 0.0);
}

#[test]
fn engagement_and_desired_force_ramp() {
    let mut control = control(ForceConfig { ki: 0.0, kp: 0.0, ..ForceConfig::default() });
    control.set_target(50.0);
    feed(&mut control, 5.0, 5);
    // First sample in contact: 2/80 of engagement, and F_d 2/80 of the way from the measured 5 N to 50 N.
    assert_relative_eq!(control.axis().engagement, 0.025, epsilon = 1e-12);
    assert_relative_eq!(control.desired, 6.125, epsilon = 1e-12);
    feed(&mut control, 5.0, 19);
    assert_relative_eq!(control.axis().engagement, 0.5, epsilon = 1e-12);
}

#[test]
fn release_removes_the_component_along_the_axis_only() {
    let n = Vector3::new(0.6, 0.0, 0.8);
    let axis = ForceAxis { direction: n, engagement: 1.0, damping_min: 60.0, damping_rate_min: 20.0 };
    let v = Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0);
    let released = axis.release(&v);
    assert_relative_eq!(linear(&released).dot(&n), 0.0, epsilon = 1e-12);
    assert_eq!(rotational(&released), rotational(&v));
    assert_relative_eq!(released[1], 2.0);
    assert_eq!(ForceAxis { engagement: 0.0, ..axis }.release(&v), v);
}

/// Presses an axis of `mass` (kg) with `damping` (Ns/m) for 8 s with 20 N on an elastic wall of 1e4 N/m, through a
/// 100 Hz force filter; returns the force's largest value (N) and its peak-to-peak motion in the last second (N).
fn press_wall(mass: f64, damping: f64) -> (f64, f64) {
    let mut control = control(ForceConfig::default());
    control.set_target(20.0);
    let (mut z, mut v, mut filtered) = (-6e-4, 0.0, 6.0);
    let filter = 1.0 - (-DT * std::f64::consts::TAU * 100.0).exp();
    let (mut peak, mut low, mut high) = (0.0f64, f64::INFINITY, 0.0f64);
    for sample in 0..4000 {
        let wall = 1e4 * f64::max(-z, 0.0); // The table pushes up on a tool that is below its surface.
        filtered += filter * (wall - filtered);
        peak = peak.max(wall);
        let f_d = control.update(&push(filtered), DT);
        // The impedance that brought the tool here presses with 6 N until force control has taken over.
        let impedance = -6.0 * (1.0 - control.axis().engagement);
        v += DT * (wall - f_d[2] + impedance - damping * v) / mass; // The tool pushes with -F_d.
        z += DT * v;
        if sample >= 3500 {
            (low, high) = (low.min(wall), high.max(wall));
        }
    }
    assert!((low + high) / 2.0 > 10.0, "contact was lost");
    (peak, high - low)
}

#[test]
fn a_wall_is_pushed_with_the_force_asked_for() {
    for mass in [5.0, 12.0, 42.0] {
        let config = ForceConfig::default();
        let least = config.damping_min.max(config.damping_rate_min * mass);
        let (peak, swing) = press_wall(mass, least);
        assert!(peak < 35.0 && swing < 0.05, "{mass} kg: peak {peak} N, swing {swing} N");
    }
}

#[test]
fn a_heavy_arm_needs_damping_in_proportion() {
    // ki = 4 > (1 + kp) 60/42 = 1.9 1/s: 60 Ns/m are not enough for 42 kg.
    assert!(press_wall(42.0, 60.0).1 > 5.0);
}

/// The tool slides over an edge: the target force, the command and the integral are the same numbers along another direction.
#[test]
fn force_control_turns_with_its_axis() {
    let mut turned = control(ForceConfig { kd: 0.01, ..ForceConfig::default() });
    feed(&mut turned, 8.0, 500);
    let mut straight = turned.clone();
    let n = Vector3::new(0.6, 0.0, 0.8);
    turned.set_direction(n);
    // 9 N along n, and the force of friction across n.
    let across = Vector3::new(0.8, 5.0, -0.6);
    let wrench = turned.update(&stack(&(9.0 * n + across), &Vector3::zeros()), DT);
    // The derivative compares with the component of the last sample, 8 N upwards, along n.
    straight.previous = Vector3::z() * (8.0 * 0.8);
    straight.update(&push(9.0), DT);
    assert_relative_eq!(turned.command(), straight.command(), epsilon = 1e-9);
    assert_relative_eq!(linear(&wrench), turned.command() * n, epsilon = 1e-9);
    assert_eq!((turned.desired(), turned.integral), (straight.desired(), straight.integral));
    assert_eq!(turned.axis().engagement, straight.axis().engagement);
}
