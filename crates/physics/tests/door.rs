//! The door: latch, handle spring, hinge.

use aforce::JointVector;
use physics::panda::{HOME, ParameterSet};
use physics::scenes::door::{self, Door, HANDLE, HINGE, MIDDLE};
use physics::{Plant, Simulation, SimulationConfig};

const DT: f64 = 0.002;

fn door() -> (Simulation, Door) {
    let parameters = ParameterSet::Robosuite.parameters();
    let plant = Plant { parameters, dt: DT, config: SimulationConfig::default() };
    let (mut simulation, door) = Door::simulate(&plant, &door::root(MIDDLE));
    simulation.reset(&HOME.into());
    (simulation, door)
}

/// Runs for `seconds` with these loads (Nm) on hinge and handle, the arm held where it is.
fn load(simulation: &mut Simulation, hinge: f64, handle: f64, seconds: f64) {
    simulation.set_load(HINGE, hinge);
    simulation.set_load(HANDLE, handle);
    let home = JointVector::from(HOME);
    for _ in 0..(seconds / DT).round() as usize {
        let y = simulation.measure();
        let tau = y.bias + y.mass * ((home - y.q) * 400.0 - y.qd * 40.0);
        simulation.step(&tau, 0.0).unwrap();
    }
}

#[test]
fn probe() {
    for hinge in [3.0, 5.0, 20.0, 60.0] {
        for sign in [1.0, -1.0] {
            for torque in [0.0, 0.4, 0.8, 1.1, 1.2, 1.25, 1.3, 1.35] {
                let (mut s, d) = door();
                load(&mut s, 0.0, sign * torque, 1.5);
                let start = d.handle_angle(&s);
                load(&mut s, hinge, sign * torque, 1.0);
                println!(
                    "hinge {hinge} handle {torque}: angle {start:.3} -> {:.3} opening {:.4} v {:.1e} pen {:.4}",
                    d.handle_angle(&s),
                    d.opening(&s),
                    s.joint(HINGE).1,
                    s.deepest_penetration()
                );
            }
        }
    }
}
