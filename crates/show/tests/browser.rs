//! The page as a browser shows it: a headless Chromium that renders in software. Without a Chromium the tests are skipped with a message.

use std::fs::File;
use std::io::{BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use show::{Playback, page};
use tasks::{Env, EnvConfig, TaskName};

/// The Chromium that the variable CHROMIUM names, or the first one on the PATH.
fn chromium() -> Option<PathBuf> {
    let named = std::env::var_os("CHROMIUM").map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let on_path = std::env::split_paths(&path).flat_map(|folder| names.map(|name| folder.join(name)));
    let found = named.into_iter().chain(on_path).find(|program| program.is_file());
    if found.is_none() {
        // Written past the capture of a test's output.
        let _ = writeln!(std::io::stderr(), "skipped: no Chromium on PATH, none in CHROMIUM");
    }
    found
}

/// A browser and the page that it opens.
struct Browser<'a> {
    program: &'a Path,
    page: &'a Path,
}

impl Browser<'_> {
    /// Opens the page at `moment` (`#t=1.2`, or nothing) for four seconds and returns standard output. Fails if the console has a message.
    fn open(&self, moment: &str, flags: &[&str]) -> String {
        let profile = tempfile::tempdir().unwrap();
        let mut command = Command::new(self.program);
        command.args(["--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]);
        command.args(["--window-size=1000,800", "--virtual-time-budget=4000", "--enable-logging=stderr"]);
        command.arg(format!("--user-data-dir={}", profile.path().display())).args(flags);
        let output = command.arg(format!("file://{}{moment}", self.page.display())).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !told.contains(":CONSOLE:"), "{told}");
        String::from_utf8(output.stdout).unwrap()
    }

    /// The page's elements after its script has run, up to its data and its script.
    fn elements(&self, moment: &str, flags: &[&str]) -> String {
        let all = self.open(moment, &[&["--dump-dom"], flags].concat());
        all.split_once("<script").unwrap().0.into()
    }

    /// Evaluates an expression in the page after the page's own script; returns its numbers in order.
    fn ask(&self, expression: &str, flags: &[&str]) -> Vec<f64> {
        let page = std::fs::read_to_string(self.page).unwrap();
        let question =
            format!("<script>document.body.dataset.answer = [{expression}].flat(9).map(Number)</script></body>");
        let file = self.page.with_extension("asked.html");
        std::fs::write(&file, page.replace("</body>", &question)).unwrap();
        let elements = Browser { program: self.program, page: &file }.elements("", flags);
        let (_, rest) = elements.split_once("data-answer=\"").unwrap();
        rest.split_once('"').unwrap().0.split(',').map(|number| number.parse().unwrap()).collect()
    }

    /// The part of a picture in which the scenes are, without headings and clock.
    fn scenes(&self, moment: &str) -> Vec<u8> {
        let picture = self.page.with_extension("png");
        self.open(moment, &[&format!("--screenshot={}", picture.display())]);
        let mut reader = png::Decoder::new(BufReader::new(File::open(picture).unwrap())).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut pixels).unwrap();
        let width = 800 * frame.color_type.samples();
        pixels.chunks_exact(frame.line_size).skip(150).take(150).flat_map(|row| row[..width].to_vec()).collect()
    }
}

/// Text of the page's clock.
fn clock(elements: &str) -> &str {
    let (_, rest) = elements.split_once(r#"id="clock">"#).unwrap();
    rest.split_once('<').unwrap().0
}

/// Time on the page's clock (s).
fn seconds(elements: &str) -> f64 {
    clock(elements).split_once(" s").unwrap().0.parse().unwrap()
}

/// The same episode's beginning in two action spaces.
fn door(actions: u32) -> [Playback; 2] {
    ["aforce-shaped", "variable"].map(|space| {
        let config = EnvConfig { task: TaskName::DOOR, space: space.parse().unwrap(), ..EnvConfig::default() };
        let mut env = Env::new(config, 0).unwrap();
        Playback::play(&mut env, Env::expert_action, 3, actions, "script", |_, _, _| Ok(())).unwrap()
    })
}

#[test]
fn the_page_loops_to_the_end_of_the_task_and_keeps_the_hand_in_sight() {
    let Some(program) = chromium() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    let episodes = door(240);
    page::write(&file, &episodes, &["What to <look> for.".into()]).unwrap();
    let browser = Browser { program: &program, page: &file };

    assert!(browser.elements("", &[]).contains("What to &lt;look&gt; for."));

    // Two seconds, 40 actions, after the later of both; then it begins again. Without the loop it stops where the episodes do.
    let first = |playback: &Playback| playback.episode.outcome().number("time_to_success_s").unwrap();
    let later = episodes.iter().map(first).fold(0.0, f64::max);
    let wrapped = "(present = loopEnd + .5, play(true), present = loopEnd + .5, draw(performance.now()), present)";
    let stopped = "(whole(), present = frames, playing = true, draw(performance.now()), [present, playing])";
    let answer = browser.ask(&format!("end(), {wrapped}, {stopped}"), &[]);
    assert_eq!(answer[..2], [(20.0 * (later + 2.0)).round() - 1.0, 0.0], "task done at {later} s");
    assert_eq!(answer[2..], [239.0, 0.0]);
    assert_eq!(clock(&browser.elements("#t=11.5", &[])), "11.50 s, action 230 of 240", "a link beyond the loop");

    let done = format!("task done at {later:.2} s");
    // Drawn by the script itself: a busy browser may draw its first picture after its elements were asked for.
    let told = |frame: f64| {
        let drawn = format!("(playing = false, present = {frame}, draw(performance.now()))");
        browser.ask(&format!("({drawn}, views.some(view => view.done.textContent === '{done}'))"), &[])
    };
    assert_eq!([told(20.0), told(20.0 * later)], [[0.0], [1.0]], "{done}");

    // Equal factors of stiffness are equal distances on its logarithmic axis, equal differences of force on its linear one.
    let distances = |panel: &str, [a, b, c]: [f64; 3]| {
        let plot = format!("plots[episodes[0].panels.findIndex(p => p.title === '{panel}')]");
        let answer = browser.ask(&format!("(drawCurves(), [{a}, {b}, {c}].map(v => {plot}.y(v)))"), &[]);
        [answer[0] - answer[1], answer[1] - answer[2]]
    };
    for [near, far] in [distances("Stiffness", [300.0, 600.0, 1200.0]), distances("Contact force", [0.0, 10.0, 20.0])] {
        assert!(near > 1.0 && (near - far).abs() < 1e-6, "{near} and {far} pixels");
    }

    // The hand is in sight from every camera of the buttons, on a wide screen and on a narrow one, at every moment of the loop.
    let moments = "Array.from({ length: loopEnd + 1 }, (_, k) => views.map(view => view.toolOnScreen(k)))";
    let places = format!("episodes[0].cameras.map(camera => (place(camera), {moments}))");
    for size in ["--window-size=1280,800", "--window-size=500,844"] {
        let answer = browser.ask(&places, &[size]);
        assert_eq!(answer.len() as f64, 4.0 * 2.0 * 2.0 * (20.0 * (later + 2.0)).round());
        let farthest = answer.iter().fold(0.0, |farthest: f64, at| farthest.max(at.abs()));
        assert!(farthest < 0.9, "{size}: the hand is {farthest} of the way to the edge");
    }

    // What a ball and the hull of a corner of a unit cube enclose, and whether the hull's normals point outwards.
    let volume = "(v => { let sum = 0; for (let i = 0; i < v.length; i += 18) { const [a, b, c] = [0, 6, 12].map(k => v.slice(i + k, i + k + 3)); \
                  sum += dot(a, cross(b, c)) / 6 } return sum })";
    let hull =
        "solidShape.triangles(0,0,0, 0,1,0, 1,0,0, 0,0,0, 1,0,0, 0,0,1, 0,0,0, 0,0,1, 0,1,0, 1,0,0, 0,1,0, 0,0,1)";
    let outwards = "(v => v.slice(-3))";
    let answer = browser.ask(&format!("{volume}(solidShape.sphere(1)), {volume}({hull}), {outwards}({hull})"), &[]);
    assert!((answer[0].abs() / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 0.02, "{answer:?}");
    assert!((answer[1] - 1.0 / 6.0).abs() < 1e-6, "{answer:?}");
    assert!(answer[2..].iter().all(|part| (part - 3f64.sqrt().recip()).abs() < 1e-6), "{answer:?}");
}

#[test]
fn the_page_plays_links_to_a_moment_and_has_curves_without_webgl() {
    let Some(program) = chromium() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    let episodes = door(240);
    page::write(&file, &episodes, &[]).unwrap();
    let browser = Browser { program: &program, page: &file };

    let elements = browser.elements("", &[]);
    assert!(seconds(&elements) > 0.05, "it plays at once: {}", clock(&elements));
    for part in [
        "contact force",
        "goal pose",
        "its leash",
        "contact of the hand",
        "Variable: the policy commands the stiffness",
    ] {
        assert!(elements.contains(part), "{part}");
    }
    for Playback { story, .. } in &episodes {
        assert!(story.starts_with("Opens the door at") && elements.contains(story), "{story}");
    }
    let curves = |elements: &str| elements.matches(r#"class="plot""#).count();
    let mut titles: Vec<_> = episodes.iter().flat_map(|episode| episode.traces.panels()).map(|p| p.title).collect();
    titles.sort();
    titles.dedup();
    assert_eq!(curves(&elements), titles.len(), "one chart for both");
    assert!(!elements.contains("No scene"));

    assert_eq!(clock(&browser.elements("#t=1.2", &[])), "1.20 s, action 24 of 240");

    let without = browser.elements("", &["--disable-3d-apis"]);
    assert_eq!(without.matches("No scene: this browser").count(), 2);
    assert!(curves(&without) == titles.len() && seconds(&without) > 0.05);

    // The scene is drawn, and another moment is another picture.
    let (early, late) = (browser.scenes("#t=0.05"), browser.scenes("#t=8"));
    let (dark, bright) = (early.iter().min().unwrap(), early.iter().max().unwrap());
    assert!(bright - dark > 100, "{dark} to {bright}");
    let changed = early.iter().zip(&late).filter(|(a, b)| a.abs_diff(**b) > 20).count();
    assert!(changed > early.len() / 200, "{changed} of {}", early.len());
}

#[test]
fn keys_work_wherever_the_focus_is_and_a_telephone_keeps_the_play_bar() {
    let Some(program) = chromium() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    page::write(&file, &door(60), &[]).unwrap();
    let browser = Browser { program: &program, page: &file };

    let press =
        "press = key => document.activeElement.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }))";
    let on = |id: &str| {
        format!("(byId('{id}').focus(), press('Home'), press('ArrowRight'), present), (press('End'), present)")
    };
    let pace = "(byId('loop').focus(), press('+'), byId('speed').value), (press('-'), press('-'), byId('speed').value)";
    let help = "(press('?'), byId('help').open), (press('End'), press('?'), byId('help').open)";
    let places = ["speed", "scrub", "play", "follow"].map(on).join(", ");
    let answer = browser.ask(&format!("({press}, 0), {places}, {pace}, {help}"), &[]);
    assert_eq!(answer[1..], [1.0, 59.0, 1.0, 59.0, 1.0, 59.0, 1.0, 59.0, 2.0, 0.5, 1.0, 0.0]);

    // However far the page is scrolled, the bar is at the bottom, and all controls are large enough for a finger.
    let bar = "(scrollTo(0, 900), innerHeight - byId('bar').getBoundingClientRect().bottom), scrollY > 500";
    let targets = "[...document.querySelectorAll('button, select, #scrub, label')].filter(e => e.offsetParent || e.closest('#bar'))";
    let smallest = format!("Math.min(...{targets}.map(e => e.getBoundingClientRect().height))");
    let answer = browser.ask(&format!("{bar}, {smallest}"), &["--window-size=500,844"]);
    assert!(answer[..2] == [0.0, 1.0] && answer[2] >= 44.0, "{answer:?}");

    // A curve of an axis and an action space never look alike.
    let colors = "Array.from({ length: 8 }, (_, k) => `--c${k}`), '--run0', '--run1'";
    let answer = browser.ask(&format!("new Set([{colors}].flat().map(hex)).size"), &[]);
    assert_eq!(answer, [10.0]);
}
