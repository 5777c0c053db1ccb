//! Lost contact, and a wrench that an observer estimates.

use super::*;

/// A tool presses on a table, and the table vanishes.
#[test]
fn after_contact_is_lost_the_tool_does_not_run_after_it() {
    let travel = |contact_loss: f64| {
        let limits = HostLimits { contact_loss, ..endless() };
        let mut setup = HostSetup { limits, ..setup("high-force") };
        // For the controller contact lasts 0.3 s longer, as with a wrench that is filtered strongly.
        setup.controller.force.contact_hold = 0.3;
        let mut plant = Plant::new(&setup);
        let table = HOME[2] - 0.002;
        let mut status = Status::Stopped;
        let mut faded = false;
        for cycle in 0..2290 {
            if cycle % 50 == 0 {
                let mut action = still(&plant.host);
                action[6] = -0.2; // 20 N.
                if plant.host.controller().engagement() == 0.0 {
                    action[2] = -0.3;
                }
                plant.host.set_goal(&action).unwrap();
            }
            let depth = table - plant.position().z;
            let touches = depth > 0.0 && cycle < 2000;
            let push = if touches { (1e4 * depth - 50.0 * plant.y.twist[2]).max(0.0) } else { 0.0 };
            if cycle == 1999 {
                assert_relative_eq!(push, 20.0, epsilon = 1.0);
            }
            status = plant.step(&Wrench::new(0.0, 0.0, push, 0.0, 0.0, 0.0));
            faded |= matches!(status, Status::Limited(limited) if limited.contains(Limited::CONTACT_LOSS));
        }
        assert!(!matches!(status, Status::Fault(_)), "{status:?}");
        assert_eq!(faded, contact_loss.is_finite());
        table - plant.position().z
    };
    let (shaped, unshaped) = (travel(0.01), travel(f64::INFINITY));
    println!("travel into the void: {shaped:.4} m shaped, {unshaped:.4} m not");
    assert!(shaped < 0.4 * unshaped, "{shaped} {unshaped}");
}

#[test]
fn an_observed_wrench_is_what_pushes() {
    let interface = ArmInterface { wrench: WrenchSource::Observed { cutoff_hz: 25.0 }, ..ArmInterface::PLAIN };
    let mut plant = Plant::new(&HostSetup { interface, ..setup("low") });
    let push = Wrench::new(3.0, -2.0, 5.0, 0.1, 0.0, -0.2);
    // The reported wrench is nonsense and must not be read.
    let nonsense = |state: &mut ArmState| state.wrench = Wrench::repeat(33.0);
    let observed = |plant: &mut Plant, period| {
        let status = plant.spoilt_step(&push, period, nonsense);
        (status, plant.host.measurement().unwrap().wrench)
    };
    for cycle in 0..1500 {
        if cycle % 50 == 0 {
            plant.host.set_goal(&[0.0; 6]).unwrap();
        }
        observed(&mut plant, DT);
    }
    let (_, settled) = observed(&mut plant, DT);
    assert_relative_eq!(settled, push, epsilon = 0.05);
    let (status, unchanged) = observed(&mut plant, 0.0);
    assert!(matches!(status, Status::Running | Status::Limited(_)));
    assert_eq!(unchanged, settled, "a cycle of no length");
    plant.host.stop();
    for _ in 0..3000 {
        let (status, held) = observed(&mut plant, DT);
        assert_eq!(status, Status::Stopped);
        assert_relative_eq!(held, push, epsilon = 0.5);
    }
}
