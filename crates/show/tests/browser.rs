//! The page as a browser shows it: a headless Chromium, drawn in software. Skipped with a word where there is none.

use std::fs::File;
use std::io::{BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use show::{Playback, page};
use tasks::{Env, EnvConfig, TaskName};

/// The one that CHROMIUM names, or the first on the PATH.
fn chromium() -> Option<PathBuf> {
    let named = std::env::var_os("CHROMIUM").map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let on_path = std::env::split_paths(&path).flat_map(|folder| names.map(|name| folder.join(name)));
    let found = named.into_iter().chain(on_path).find(|program| program.is_file());
    if found.is_none() {
        // Past the capture of a test's output.
        let _ = writeln!(std::io::stderr(), "skipped: no Chromium on PATH, none in CHROMIUM");
    }
    found
}

/// What a page is looked at with.
struct Browser<'a> {
    program: &'a Path,
    page: &'a Path,
}

impl Browser<'_> {
    /// Opens the page at `moment` (`#t=1.2`, or nothing) for four seconds; standard output. Fails on a word in the console.
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

    /// What became of the page's elements, those before its data and its script.
    fn elements(&self, moment: &str, flags: &[&str]) -> String {
        let all = self.open(moment, &[&["--dump-dom"], flags].concat());
        all.split_once("<script").unwrap().0.into()
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

/// Time that it shows (s).
fn seconds(elements: &str) -> f64 {
    clock(elements).split_once(" s").unwrap().0.parse().unwrap()
}

#[test]
fn the_page_plays_links_to_a_moment_and_has_curves_without_webgl() {
    let Some(program) = chromium() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    let play = |space: &str| {
        let config = EnvConfig { task: TaskName::Door, space: space.parse().unwrap(), ..EnvConfig::default() };
        let mut env = Env::new(config, 0).unwrap();
        Playback::play(&mut env, Env::expert_action, 3, 200, "script", |_, _, _| Ok(())).unwrap()
    };
    let episodes = [play("aforce-shaped"), play("variable")];
    page::write(&file, &episodes).unwrap();
    let browser = Browser { program: &program, page: &file };

    let elements = browser.elements("", &[]);
    assert!(seconds(&elements) > 0.05, "it plays at once: {}", clock(&elements));
    for part in ["contact force", "goal pose", "its leash", "contact of the hand", "door variable"] {
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

    assert_eq!(clock(&browser.elements("#t=1.2", &[])), "1.20 s, action 24 of 200");

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
