//! An episode, or two side by side, as one HTML page that loads nothing else.

use std::path::Path;

use anyhow::Result;
use output::file;
use serde_json::{Value, json};

use crate::playback::Playback;
use crate::plot::{Panel, Series};
use crate::recording::Packed;
use crate::{arrow, palette};

/// Everything but the data, which takes the place of [`DATA`].
const TEMPLATE: &str = include_str!("../assets/replay.html");
const DATA: &str = "{{data}}";

/// Panels with a logarithmic axis: stiffness runs over two decades, and on a linear axis the curve of a soft arm would lie at zero.
const LOGARITHMIC: [&str; 2] = ["Stiffness", "Rotational stiffness"];

/// Writes the page; the second episode, if any, stands to the right of the first, and the `notes` above both, a paragraph each.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, episodes: &[Playback], notes: &[String]) -> Result<()> {
    file::replace(path, page(episodes, notes).as_bytes())
}

fn page(episodes: &[Playback], notes: &[String]) -> String {
    let command: Vec<String> = output::command().iter().map(|word| quoted(word)).collect();
    let data = json!({
        "command": command.join(" "),
        "commit": output::commit(),
        "notes": notes,
        "episodes": episodes.iter().map(json).collect::<Vec<_>>(),
    });
    // Without a "<" nothing ends the script element, nor opens a comment in it.
    TEMPLATE.replace(DATA, &data.to_string().replace('<', "\\u003c"))
}

/// A word, quoted for a shell where that is needed.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_=./:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.into() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

fn json(playback: &Playback) -> Value {
    let series = |series: &Series| {
        let values: Packed = series.points.iter().map(|point| point.1).collect();
        json!({"label": series.label, "values": values})
    };
    let panel = |panel: &Panel| {
        let series: Vec<Value> = panel.series.iter().map(series).collect();
        let (title, logarithmic) = (&panel.title, LOGARITHMIC.contains(&panel.title.as_str()));
        json!({"title": title, "unit": panel.y_label, "note": note(title), "logarithmic": logarithmic, "series": series})
    };
    let mut episode = playback.recording.json();
    episode["title"] = json!(playback.title);
    episode["called"] = json!(playback.called);
    episode["decides"] = json!(playback.stiffness);
    episode["task"] = json!(playback.task);
    episode["color"] = json!(palette::of_space(&playback.space));
    episode["who"] = json!(playback.who);
    episode["story"] = json!(playback.story);
    episode["detail"] = json!(playback.detail);
    episode["metresPerNewton"] = json!(arrow::METRES_PER_NEWTON);
    episode["rate"] = json!(playback.rate);
    // The stiffness, in which the spaces differ, comes first.
    let mut panels = playback.traces.panels();
    panels.sort_by_key(|panel| panel.title != LOGARITHMIC[0]);
    episode["panels"] = panels.iter().map(panel).collect();
    episode
}

/// Explains the curves of a panel, where their names are not enough.
fn note(panel: &str) -> &'static str {
    match panel {
        "Contact force" => {
            "hand is all beyond the wrist; mean and largest are over an action; normal is the force along the contact axis at its end, \
             requested what the policy asked for then, desired what force control followed"
        }
        "Stiffness" | "Rotational stiffness" => {
            "K along each axis at the end of an action; alpha/mu is the stiffness that F_ff adds under a lasting error"
        }
        "Position error" => "set-point to tool, at the end of an action",
        "Feed-forward force" | "Feed-forward torque" => "at the end of an action",
        "Force of the impedance" | "Moment of the impedance" => "size of each part, mean over an action",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;
    use base64::prelude::BASE64_STANDARD;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use tasks::{Env, EnvConfig, TaskName};

    fn floats(value: &Value) -> Vec<f32> {
        let bytes = BASE64_STANDARD.decode(value.as_str().unwrap()).unwrap();
        bytes.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect()
    }

    /// What a browser would parse.
    fn data(page: &str) -> Value {
        let (_, rest) = page.split_once(r#"<script id="data" type="application/json">"#).unwrap();
        serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
    }

    /// A script wipes: the longest of the recordings, with markers that change their colour.
    #[test]
    fn a_whole_episode_reads_back_from_a_small_page() {
        let config = EnvConfig { task: TaskName::WIPE, ..EnvConfig::default() };
        let mut env = Env::new(config, 0).unwrap();
        let mut poses = vec![];
        let mut wiped = vec![];
        let playback =
            Playback::play(&mut env, Env::expert_action, 3, 500, "a </script> & \"quotes\"", |env, step, _| {
                let simulation = env.simulation();
                let placed =
                    simulation.solids().iter().map(|s| s.body.map_or(s.pose, |b| simulation.body_pose(b) * s.pose));
                poses.push(placed.collect::<Vec<_>>());
                wiped.push((env.task().decals(), step.penalty > 0.0, step.success));
                Ok(())
            })
            .unwrap();
        let page = page(&[playback], &["It is <b>seen</b>.".into()]);
        assert!(page.len() < 1_000_000, "{} bytes", page.len());
        let episode = &data(&page)["episodes"][0];
        assert_eq!(episode["frames"], 500);
        assert_eq!(episode["who"], "a </script> & \"quotes\"");
        assert_eq!(data(&page)["notes"][0], "It is <b>seen</b>.");
        let panels = episode["panels"].as_array().unwrap();
        let logarithmic = panels.iter().filter(|panel| panel["logarithmic"] == true).map(|panel| &panel["title"]);
        assert_eq!(logarithmic.collect::<Vec<_>>(), ["Stiffness", "Rotational stiffness"]);

        // Every shape stands where it was simulated.
        let (bodies, recorded) = (episode["bodies"].as_u64().unwrap() as usize, floats(&episode["poses"]));
        let pose = |seven: &[f32]| {
            let seven: Vec<f64> = seven.iter().map(|&v| f64::from(v)).collect();
            physics::scene::pose(*seven.first_chunk().unwrap(), *seven.last_chunk().unwrap())
        };
        for (frame, poses) in poses.iter().enumerate() {
            for (solid, expected) in episode["solids"].as_array().unwrap().iter().zip(poses) {
                let local: Vec<f32> = serde_json::from_value(solid["pose"].clone()).unwrap();
                let body = solid["body"].as_u64().map(|body| 7 * (frame * bodies + body as usize));
                let placed = body.map_or(pose(&local), |at| pose(&recorded[at..at + 7]) * pose(&local));
                let error = placed.inverse() * expected;
                assert!(error.translation.vector.norm() < 1e-6 && error.rotation.angle() < 1e-6, "frame {frame}");
            }
        }

        // Decals have the right colour in every frame, and penalties are in the right frames.
        assert!(wiped.first() != wiped.last(), "something is wiped");
        for (frame, (decals, penalised, fulfilled)) in wiped.iter().enumerate() {
            for decal in decals {
                let near =
                    |track: &Value, i: usize| (track["centre"][i].as_f64().unwrap() - decal.centre[i]).abs() < 1e-12;
                let same = |track: &&Value| (0..3).all(|i| near(track, i));
                let track = episode["decals"].as_array().unwrap().iter().find(same).unwrap();
                let changes = track["colors"].as_array().unwrap();
                let last = changes.iter().rfind(|change| change[0].as_u64().unwrap() <= frame as u64).unwrap();
                assert_eq!(last[1], json!(decal.color));
            }
            let said = |what: &str| episode[what].as_array().unwrap().contains(&json!(frame));
            assert_eq!((said("penalised"), said("fulfilled")), (*penalised, *fulfilled));
        }
        for series in episode["panels"].as_array().unwrap().iter().flat_map(|p| p["series"].as_array().unwrap()) {
            assert_eq!(floats(&series["values"]).len(), 500, "{series}");
        }
    }

    /// The name of a folder may have any characters.
    #[test]
    fn whatever_it_is_called_the_data_reads_back() {
        let mut names = ["</script>", "<!--<script>", "-->", "]]>", "\u{2028}\0\u{7f}", "{{data}}", "\\u003c", "'\"`"]
            .map(String::from)
            .to_vec();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let parts = names.clone();
        names.extend((0..1000).map(|_| (0..5).map(|_| parts[rng.random_range(0..parts.len())].as_str()).collect()));
        for who in names {
            let page = page(&[Playback { who: who.clone(), ..Playback::default() }], &[]);
            assert_eq!(data(&page)["episodes"][0]["who"], who.as_str());
            assert_eq!(page.matches('<').count(), TEMPLATE.matches('<').count(), "{who}");
        }
    }

    #[test]
    fn a_command_can_be_typed_again() {
        assert_eq!(quoted("results/a_b,n=5"), "results/a_b,n=5");
        assert_eq!(quoted("it's two words"), r"'it'\''s two words'");
        assert_eq!(quoted(""), "''");
    }

    #[test]
    fn the_page_needs_nothing_else() {
        for outside in ["http:", "https:", "src=", "href=", "url(", "@import", "import(", "fetch("] {
            assert!(!TEMPLATE.contains(outside), "{outside}");
        }
        assert_eq!(TEMPLATE.matches(DATA).count(), 1);
    }
}
