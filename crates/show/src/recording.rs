//! What is needed to show an episode in three dimensions: shapes, and where they are after every action.

use aforce::{Pose, Vector3};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use physics::camera::Decal;
use physics::{Simulation, Solid};
use serde::ser::{Serialize, Serializer};
use serde_json::{Value, json};
use tasks::{Env, Step};

use crate::view::View;

/// Numbers as base64 of little-endian f32: compact, and read in one step by a browser.
#[derive(Debug, Clone, Default)]
pub struct Packed(Vec<f32>);

impl Extend<f64> for Packed {
    fn extend<T: IntoIterator<Item = f64>>(&mut self, values: T) {
        self.0.extend(values.into_iter().map(|v| v as f32));
    }
}

impl FromIterator<f64> for Packed {
    fn from_iter<T: IntoIterator<Item = f64>>(values: T) -> Self {
        let mut packed = Packed::default();
        packed.extend(values);
        packed
    }
}

impl Serialize for Packed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let bytes: Vec<u8> = self.0.iter().flat_map(|v| v.to_le_bytes()).collect();
        serializer.serialize_str(&BASE64_STANDARD.encode(bytes))
    }
}

/// One episode, a frame after every action.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    frames: usize,
    solids: Vec<Solid>,
    /// The moving bodies that carry solids.
    bodies: Vec<usize>,
    cameras: Vec<Value>,
    /// Of every body in every frame: x, y, z (m), quaternion w, x, y, z.
    poses: Packed,
    /// Of every frame, along the world's axes: the tool's position (m), the sustained contact
    /// force on it (N), its translational stiffness as far as it acts (N/m).
    tool: Packed,
    force: Packed,
    stiffness: Packed,
    /// Of every frame: the goal pose of the last action, as in `poses`.
    goal: Packed,
    /// How far the goal may be from the tool (m), where the action space says so.
    leash: Option<f64>,
    decals: Vec<DecalTrack>,
    /// Frames after actions whose force exceeded the limit.
    penalised: Vec<usize>,
    /// Frames after actions that left the task fulfilled.
    fulfilled: Vec<usize>,
    /// Frames after actions during which something touched the hand, and those during which the scene touched another link.
    touched: Vec<usize>,
    links_touched: Vec<usize>,
    /// Frames after actions during which a joint's torque was cut to its limit.
    limited: Vec<usize>,
    /// The frame after the action in which the simulation diverged.
    diverged: Vec<usize>,
}

/// A decal over time. A decal that moves or changes its size is a new track from then on.
#[derive(Debug, Clone)]
struct DecalTrack {
    centre: [f64; 3],
    radius: f64,
    /// The first frame of each colour; with `None` the decal is not there.
    colors: Vec<(usize, Option<[u8; 3]>)>,
}

impl DecalTrack {
    fn is_of(&self, decal: &Decal) -> bool {
        (self.centre, self.radius) == (decal.centre, decal.radius)
    }
}

impl Recording {
    /// Adds the state after one action.
    pub fn add(&mut self, env: &Env, step: &Step) {
        let simulation = env.simulation();
        if self.frames == 0 {
            self.start(env);
        }
        for &body in &self.bodies {
            self.poses.extend(seven(&simulation.body_pose(body)));
        }
        self.tool.extend(tool(env).iter().copied());
        self.force.extend(contact_force(simulation).iter().copied());
        self.stiffness.extend(acting_stiffness(env));
        self.add_decals(&env.task().decals());
        self.goal.extend(seven(env.controller().goal()));
        let interval = &step.interval;
        for (list, happened) in [
            (&mut self.penalised, step.over_limit),
            (&mut self.fulfilled, step.success),
            (&mut self.touched, interval.contact_time > 0.0),
            (&mut self.links_touched, interval.link_contact_time > 0.0),
            (&mut self.limited, interval.saturated() > 0.0),
            (&mut self.diverged, step.diverged),
        ] {
            if happened {
                list.push(self.frames);
            }
        }
        self.frames += 1;
    }

    /// Adds the decals of a frame. Of two at the same place the last one is seen.
    fn add_decals(&mut self, decals: &[Decal]) {
        for decal in decals {
            if !self.decals.iter().any(|track| track.is_of(decal)) {
                self.decals.push(DecalTrack { centre: decal.centre, radius: decal.radius, colors: vec![] });
            }
        }
        for track in &mut self.decals {
            let color = decals.iter().rfind(|decal| track.is_of(decal)).map(|decal| decal.color);
            if track.colors.last().is_none_or(|last| last.1 != color) {
                track.colors.push((self.frames, color));
            }
        }
    }

    fn start(&mut self, env: &Env) {
        self.solids = env.simulation().solids().to_vec();
        self.bodies = self.solids.iter().filter_map(|solid| solid.body).collect();
        self.bodies.sort_unstable();
        self.bodies.dedup();
        let camera = |view: View| {
            let camera = view.of(&env.task().camera());
            json!({"name": view.name(), "eye": camera.eye, "target": camera.target, "fov": camera.field_of_view})
        };
        self.leash = env.controller().space().goal.leash();
        self.cameras = View::ALL.map(camera).into();
    }

    /// What the page reads.
    pub fn json(&self) -> Value {
        let solid = |solid: &Solid| {
            let (kind, size) = solid.shape.kind_and_sizes();
            let body = solid.body.map(|body| self.bodies.iter().position(|&b| b == body));
            json!({"kind": kind, "size": size, "body": body, "pose": seven(&solid.pose), "color": solid.color})
        };
        let decal = |d: &DecalTrack| json!({"centre": d.centre, "radius": d.radius, "colors": d.colors});
        json!({
            "frames": self.frames,
            "solids": self.solids.iter().map(solid).collect::<Vec<_>>(),
            "bodies": self.bodies.len(),
            "cameras": self.cameras,
            "poses": self.poses,
            "tool": self.tool,
            "force": self.force,
            "stiffness": self.stiffness,
            "goal": self.goal,
            "leash": self.leash,
            "decals": self.decals.iter().map(decal).collect::<Vec<_>>(),
            "penalised": self.penalised,
            "fulfilled": self.fulfilled,
            "touched": self.touched,
            "linksTouched": self.links_touched,
            "limited": self.limited,
            "diverged": self.diverged,
        })
    }
}

/// Where the contact force is drawn: the tool point (m, world), from the true joint angles and not the measured ones.
pub fn tool(env: &Env) -> Vector3 {
    let simulation = env.simulation();
    simulation.model().kinematics(&simulation.joints().0).tool.translation.vector
}

/// The sustained contact force on the tool (N, world).
pub fn contact_force(simulation: &Simulation) -> Vector3 {
    simulation.contact().sustained.fixed_rows::<3>(0).into()
}

/// Diagonal of the translational stiffness less what force control has taken over:
/// K (I - engagement n n^T) (N/m, world axes).
fn acting_stiffness(env: &Env) -> [f64; 3] {
    let (stiffness, engagement) = (env.controller().stiffness(), env.controller().engagement());
    let n = env.controller().contact_axis();
    std::array::from_fn(|i| stiffness[i] * (1.0 - engagement * n[i] * n[i]))
}

fn seven(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, pose.rotation);
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mark that goes and comes back, one that moves, one that grows, and one that comes later.
    #[test]
    fn decals_are_where_and_when_they_were() {
        let at = |x: f64, radius: f64| Decal { centre: [x, 0.0, 0.9], radius, color: [1, 2, 3] };
        let stays = Decal { color: [9, 9, 9], ..at(9.0, 0.1) };
        let frames = [
            vec![stays, at(0.0, 0.1), at(1.0, 0.1), at(3.0, 0.1)],
            vec![stays, at(1.5, 0.1), at(3.0, 0.2)],
            vec![stays, at(0.0, 0.1), at(1.5, 0.1), at(3.0, 0.2), at(4.0, 0.1)],
        ];
        let mut recording = Recording::default();
        for decals in &frames {
            recording.add_decals(decals);
            recording.frames += 1;
        }
        let said = recording.json();
        let tracks = said["decals"].as_array().unwrap();
        for (frame, decals) in frames.iter().enumerate() {
            // As the page draws it: the last colour that has begun, unless that is none.
            let drawn = tracks.iter().filter_map(|track| {
                let colors = track["colors"].as_array().unwrap();
                let color = &colors.iter().rfind(|change| change[0].as_u64().unwrap() <= frame as u64)?[1];
                let decal = json!([track["centre"], track["radius"], color]);
                (!color.is_null()).then(|| decal.to_string())
            });
            let there = decals.iter().map(|decal| json!([decal.centre, decal.radius, decal.color]).to_string());
            let [mut drawn, mut there] = [drawn.collect::<Vec<_>>(), there.collect()];
            drawn.sort();
            there.sort();
            assert_eq!(drawn, there, "frame {frame}");
        }
        assert_eq!(tracks[0]["colors"], json!([[0, [9, 9, 9]]]), "what stays says so once");
    }
}
