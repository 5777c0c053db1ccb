//! An observed camera tells distances that geometry confirms, from the task's place and from the hand.

use aforce::Vector3;
use tasks::{Env, EnvConfig, FARTHEST, ObservationOptions, ObservedCamera, PixelKind, Pixels, Standpoint};

const SIDE: u32 = 41;

fn env(kind: PixelKind, from: Standpoint) -> Env {
    let camera = Some(ObservedCamera { width: SIDE, height: SIDE, kind, from });
    let observation = ObservationOptions { camera, ..ObservationOptions::default() };
    let mut env = Env::new(EnvConfig { observation, ..EnvConfig::default() }, 1).unwrap();
    env.reset(Some(1));
    env
}

fn depths(env: &Env) -> Vec<f32> {
    let Some(Pixels::Depth(depths)) = env.pixels() else { panic!("depths") };
    assert_eq!(depths.len(), (SIDE * SIDE) as usize);
    depths
}

/// The pixel in the middle looks along the camera's axis; what it meets is found there by the ray itself. Of a table that the camera
/// looks at from above, lower rows are nearer.
#[test]
fn depths_are_metres_along_the_cameras_axis() {
    let env = env(PixelKind::Depth, Standpoint::Task);
    let depths = depths(&env);
    let camera = env.task().camera();
    let (eye, target) = (Vector3::from(camera.eye), Vector3::from(camera.target));
    let (distance, ..) = env.simulation().surfaces().cast(&eye, &(target - eye).normalize()).unwrap();
    let middle = depths[(SIDE * SIDE / 2) as usize];
    assert!((f64::from(middle) - distance).abs() < 1e-6, "{middle} {distance}");
    assert!(depths.iter().all(|depth| *depth > 0.1 && f64::from(*depth) <= FARTHEST));
}

/// The hand hangs over a level table, whose top lies at 0.8 m: no pixel sees deeper than the floor, and most see the table.
#[test]
fn the_hand_sees_the_table() {
    let env = env(PixelKind::Depth, Standpoint::Hand);
    let height = env.simulation().measure().pose.translation.z - 0.8;
    let seen = depths(&env);
    let table = seen.iter().filter(|depth| (f64::from(**depth) - height).abs() < 0.5 * height + 0.1);
    assert!(table.count() * 2 > seen.len(), "{height} {seen:?}");
}

#[test]
fn colours_are_those_of_a_picture() {
    let env = env(PixelKind::Rgb, Standpoint::Task);
    let side = SIDE as usize;
    let picture = env.task().camera().render(env.simulation(), &env.task().decals(), side, side);
    assert_eq!(env.pixels(), Some(Pixels::Rgb(picture.rgb)));
    let plain = Env::new(EnvConfig::default(), 1).unwrap();
    assert_eq!(plain.pixels(), None);
}

#[test]
fn a_picture_of_no_size_is_refused() {
    let camera = Some(ObservedCamera { width: 0, ..ObservedCamera::default() });
    let observation = ObservationOptions { camera, ..ObservationOptions::default() };
    let refused = Env::new(EnvConfig { observation, ..EnvConfig::default() }, 1).err().unwrap().to_string();
    assert!(refused.starts_with("env.observation.camera.width = 0"), "{refused}");
}
