//! Readers of files cope with any bytes: no panic, no allocation far beyond the file's size, no hang. Files that people
//! write (TOML, tables) and files that disks damage (checkpoints) are mangled with fixed seeds, FUZZ_INPUTS times each
//! (1000 by default; for a checkpoint, over all of its files).

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use experiments::config::{RunConfig, sweep};
use experiments::report::archive;
use experiments::report::columns::Columns;
use experiments::report::table::Table;
use experiments::run::csv_table::CsvTable;
use experiments::run::csv_writer::{cut_after, last_step};
use experiments::run::disturbances;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sac::{Actor, Checkpoint, Config, Replay, Sac, Transition};
use tasks::TaskName;

/// Notes the largest allocation of each thread.
struct Noting;

thread_local! {
    static LARGEST: Cell<usize> = const { Cell::new(0) };
}

fn note(size: usize) {
    // A thread that is ending no longer has the value.
    let _ = LARGEST.try_with(|largest| largest.set(largest.get().max(size)));
}

// SAFETY: the system's allocator does all the work.
unsafe impl GlobalAlloc for Noting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: as the caller promised.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: as the caller promised.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(size);
        // SAFETY: as the caller promised.
        unsafe { System.realloc(old, layout, size) }
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // SAFETY: as the caller promised.
        unsafe { System.dealloc(old, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Noting = Noting;

/// Texts that are likely to break a reader.
const WORDS: [&[u8]; 16] = [
    b"NaN",
    b"-1",
    b"1e999",
    b"18446744073709551616",
    b"4294967295",
    b"\"",
    b"'''",
    b"[",
    b"]",
    b"{",
    b"=",
    b",",
    b".",
    b"\n",
    b"\0",
    b"\xff\xff",
];

/// One of `bases`, mangled at up to eight places; now and then nothing but noise.
fn mangled(bases: &[Vec<u8>], rng: &mut ChaCha8Rng) -> Vec<u8> {
    if rng.random_range(0..20) == 0 {
        let mut noise = vec![0; rng.random_range(0..200)];
        rng.fill_bytes(&mut noise);
        return noise;
    }
    let mut bytes = bases[rng.random_range(0..bases.len())].clone();
    for _ in 0..rng.random_range(1..=8) {
        let at = rng.random_range(0..=bytes.len());
        let end = (at + rng.random_range(0..40)).min(bytes.len());
        match rng.random_range(0..7) {
            0 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
            1 if at < bytes.len() => bytes[at] = rng.random_range(0..=255),
            2 => drop(bytes.drain(at..end)),
            3 => drop(bytes.splice(at..at, bytes[at..end].to_vec())),
            4 if rng.random_range(0..4) == 0 => bytes.truncate(at),
            5 => {
                let other = &bases[rng.random_range(0..bases.len())];
                let from = rng.random_range(0..=other.len());
                let part = other[from..(from + 40).min(other.len())].to_vec();
                drop(bytes.splice(at..end, part));
            }
            _ => drop(bytes.splice(at..at, WORDS[rng.random_range(0..WORDS.len())].iter().copied())),
        }
    }
    bytes
}

/// Number of inputs per reader.
fn inputs() -> u64 {
    std::env::var("FUZZ_INPUTS").map_or(1000, |count| count.parse().expect("a number"))
}

/// Writes mangled `bases` to `path`, so many `inputs`, and reads each with `read`, which may read `size` bytes of other files besides.
fn fuzz(name: &str, path: &Path, bases: &[Vec<u8>], inputs: u64, size: usize, mut read: impl FnMut()) {
    let (start, mut most) = (Instant::now(), 0.0f64);
    for seed in 0..inputs {
        let bytes = mangled(bases, &mut ChaCha8Rng::seed_from_u64(seed));
        fs::write(path, &bytes).unwrap();
        LARGEST.set(0);
        let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(&mut read)).is_err();
        let (largest, allowed) = (LARGEST.get(), (1 << 20) + 64 * (bytes.len() + size));
        assert!(
            !panicked && largest < allowed,
            "{name}, seed {seed}: panicked {panicked}, allocated {largest} of {allowed}"
        );
        most = most.max(largest as f64 / allowed as f64);
    }
    let rate = inputs as f64 / start.elapsed().as_secs_f64();
    eprintln!("{name}: {inputs} inputs, {rate:.0} a second, largest allocation {most:.2} of what is allowed");
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn texts(names: &[&str]) -> Vec<Vec<u8>> {
    names.iter().map(|name| fs::read(root().join(name)).unwrap()).collect()
}

#[test]
fn toml_that_people_write() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mangled.toml");
    let mut runs = texts(&["experiments/configs/second-study/door.toml", "experiments/configs/demo.toml"]);
    runs.push(RunConfig::preset(sac::Preset::DESKTOP).to_toml().into_bytes());
    fuzz("configuration of a run", &path, &runs, inputs(), 0, || drop(RunConfig::resolve(Some(&path), &[])));
    let sweeps = texts(&["experiments/configs/observation.toml", "experiments/configs/study/hidden.toml"]);
    fuzz("sweep", &path, &sweeps, inputs(), 0, || drop(sweep::read(&path)));
    let lists = texts(&["experiments/configs/disturbances.toml"]);
    fuzz("disturbances", &path, &lists, inputs(), 0, || drop(disturbances::read(&path, TaskName::LIFT)));
}

#[test]
fn tables_that_people_edit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mangled.csv");
    let run = archive::read(&root().join("results/study/tuned")).unwrap().remove(0);
    let tables = [Table::Episodes, Table::Eval, Table::Progress].map(|table| {
        let CsvTable { headers, rows, .. } = run.csv(table).unwrap().unwrap();
        let mut writer = csv::Writer::from_writer(vec![]);
        [&headers].into_iter().chain(&rows[..3]).for_each(|row| writer.write_record(row).unwrap());
        writer.into_inner().unwrap()
    });
    fuzz("table", &path, &tables, inputs(), 0, || {
        drop(CsvTable::read(&path));
        if let Ok(table) = Columns::read(&path) {
            drop(["return", "step", "success"].map(|column| table.mean_by_step(column)));
            drop(table.running_mean("return", 20));
        }
        drop(last_step(&path));
        drop(cut_after(&path, 1000));
    });
}

/// Saves a checkpoint of a learner with few weights, and its replay buffer.
fn checkpoint(folder: &Path) -> Config {
    let config = Config { hidden: vec![4], batch_size: 4, replay_capacity: 30, ..Config::default() };
    let (sac, mut replay) = (Sac::new(&config, (3, 2), 1).unwrap(), Replay::new(&config, (3, 2)));
    for k in 0..40 {
        let x = [k as f32, 1.0, 0.5];
        let action = [0.1, 0.2];
        let transition = Transition {
            observation: &x,
            action: &action,
            reward: 1.0,
            next_observation: &x,
            terminated: false,
            truncated: k % 10 == 9,
        };
        replay.push(&transition).unwrap();
    }
    Checkpoint::save(folder, &sac, Some(&replay), serde_json::json!({ "step": 40 })).unwrap();
    config
}

/// Each file of a checkpoint has a thread, with a checkpoint of its own in which this file is damaged.
#[test]
fn checkpoints_that_disks_damage() {
    let files = ["actor", "online_actor", "critic", "target", "optimizer"].map(|name| format!("{name}.safetensors"));
    let files: Vec<String> = files.into_iter().chain(["replay.bin", "state.json"].map(String::from)).collect();
    let files = &files;
    std::thread::scope(|scope| {
        for name in files {
            scope.spawn(move || {
                let folder = tempfile::tempdir().unwrap();
                let config = checkpoint(folder.path());
                let size = |name: &String| fs::metadata(folder.path().join(name)).unwrap().len() as usize;
                let (size, file) = (files.iter().map(size).sum(), folder.path().join(name));
                let whole = fs::read(&file).unwrap();
                fuzz(name, &file, std::slice::from_ref(&whole), inputs() / files.len() as u64, size, || {
                    drop(Checkpoint::load(folder.path(), &config, (3, 2)));
                    drop(Actor::load(folder.path(), 3, 2, 1));
                });
                fs::write(file, whole).unwrap();
                Checkpoint::load(folder.path(), &config, (3, 2)).unwrap();
            });
        }
    });
}
