//! The event files that a run writes for TensorBoard: read by their format, and by TensorBoard's own reader where Python
//! has one; `PYTHON` names another Python.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::process::Command;

use experiments::run::tensorboard::events::EventFile;

/// Step and value of every scalar of every tag.
type Scalars = BTreeMap<String, Vec<(u64, f32)>>;

/// The scalars of the event files in `folder`, one file after the other. A file that says that a session starts at some
/// step deletes the scalars of earlier files at this step and later ones.
fn read(folder: &Path) -> Scalars {
    let files = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let mut files: Vec<_> = files.filter(|path| path.to_str().unwrap().contains("tfevents")).collect();
    files.sort();
    let mut scalars = Scalars::new();
    for file in files {
        let bytes = std::fs::read(file).unwrap();
        let events: Vec<Event> = records(&bytes).into_iter().map(Event::read).collect();
        assert_eq!(events[0].file_version.as_deref(), Some("brain.Event:2"));
        for event in events {
            assert!(event.wall_time > 1.6e9, "seconds since 1970");
            if event.session_starts {
                scalars.values_mut().for_each(|values| values.retain(|(step, _)| *step < event.step));
            }
            for (tag, value) in event.scalars {
                scalars.entry(tag).or_default().push((event.step, value));
            }
        }
    }
    check_with_tensorboard(folder, &scalars);
    scalars
}

/// The message `Event` of TensorBoard's event.proto and summary.proto, as far as there are scalars in it.
#[derive(Debug, Default, PartialEq)]
struct Event {
    wall_time: f64,
    step: u64,
    file_version: Option<String>,
    session_starts: bool,
    scalars: Vec<(String, f32)>,
}

impl Event {
    fn read(message: &[u8]) -> Self {
        let mut event = Event::default();
        for (number, field) in fields(message) {
            match (number, field) {
                (1, Field::Eight(bits)) => event.wall_time = f64::from_bits(bits),
                (2, Field::Number(step)) => event.step = step,
                (3, Field::Bytes(version)) => event.file_version = Some(text(version)),
                (5, Field::Bytes(summary)) => event.scalars = fields(summary).into_iter().map(scalar).collect(),
                (7, Field::Bytes(log)) => event.session_starts = fields(log) == [(1, Field::Number(1))],
                other => panic!("{other:?} in an event"),
            }
        }
        event
    }
}

/// A summary's value: tag and number.
fn scalar((number, value): (u64, Field)) -> (String, f32) {
    let Field::Bytes(value) = value else { panic!("{value:?} is not a message") };
    match fields(value)[..] {
        [(1, Field::Bytes(tag)), (2, Field::Four(bits))] if number == 1 => (text(tag), f32::from_bits(bits)),
        ref other => panic!("{other:?} in a summary"),
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The content of a field of a protocol buffer, by its wire type.
#[derive(Debug, PartialEq)]
enum Field<'a> {
    Number(u64),
    Eight(u64),
    Bytes(&'a [u8]),
    Four(u32),
}

/// Numbers and contents of the fields of a protocol buffer.
fn fields(mut rest: &[u8]) -> Vec<(u64, Field<'_>)> {
    let mut fields = vec![];
    while !rest.is_empty() {
        let key = varint(&mut rest);
        let field = match key & 7 {
            0 => Field::Number(varint(&mut rest)),
            1 => Field::Eight(u64::from_le_bytes(take(&mut rest, 8).try_into().unwrap())),
            2 => {
                let length = varint(&mut rest);
                Field::Bytes(take(&mut rest, length))
            }
            5 => Field::Four(u32::from_le_bytes(take(&mut rest, 4).try_into().unwrap())),
            other => panic!("no wire type {other}"),
        };
        fields.push((key >> 3, field));
    }
    fields
}

fn varint(rest: &mut &[u8]) -> u64 {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = take(rest, 1)[0];
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            break;
        }
    }
    value
}

fn take<'a>(rest: &mut &'a [u8], length: u64) -> &'a [u8] {
    rest.split_off(..length as usize).expect("cut off")
}

/// The records of a TFRecord file: length, its checksum, content, its checksum.
fn records(mut rest: &[u8]) -> Vec<&[u8]> {
    let checked = |content: &[u8], sum: &[u8]| assert_eq!(masked_crc32c(content).to_le_bytes(), sum);
    let mut records = vec![];
    while !rest.is_empty() {
        let length = take(&mut rest, 8);
        checked(length, take(&mut rest, 4));
        let content = take(&mut rest, u64::from_le_bytes(length.try_into().unwrap()));
        checked(content, take(&mut rest, 4));
        records.push(content);
    }
    records
}

/// CRC-32C by its definition (every byte from its lowest bit on, inverted before and after), then TFRecord's mask.
fn masked_crc32c(bytes: &[u8]) -> u32 {
    let mut remainder = !0u32;
    for byte in bytes {
        remainder ^= u32::from(byte.reverse_bits()) << 24;
        for _ in 0..8 {
            remainder = remainder << 1 ^ if remainder >> 31 == 1 { 0x1edc_6f41 } else { 0 };
        }
    }
    let crc = !remainder.reverse_bits();
    crc.rotate_right(15).wrapping_add(0xa282_ead8)
}

fn python() -> Command {
    Command::new(std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into()))
}

/// Checks that TensorBoard itself reads the same. Without TensorBoard it prints a notice directly to stderr, because the
/// test harness captures other output.
fn check_with_tensorboard(folder: &Path, scalars: &Scalars) {
    let found = python().args(["-c", "import tensorboard"]).output().is_ok_and(|output| output.status.success());
    if !found {
        let word = "SKIPPED: TensorBoard's own reader; Python has no tensorboard (PYTHON names another Python)\n";
        std::io::stderr().write_all(word.as_bytes()).unwrap();
        return;
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../scripts/read_events.py");
    let output = python().arg(script).arg(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(&serde_json::from_slice::<Scalars>(&output.stdout).unwrap(), scalars);
}

/// The reader above takes a record that TensorBoard 2.21 itself wrote.
#[test]
fn a_record_of_tensorboard_is_read() {
    let file =
        b"\x1a\0\0\0\0\0\0\0\x12\x9b\xd8-\t\0\0\0\0\0\x08p@\x10\xac\x02*\x0c\n\n\n\x03a/b\x15\0\0\xc0\xbf~\xef!\xa2";
    let event = Event { wall_time: 256.5, step: 300, scalars: vec![("a/b".into(), -1.5)], ..Event::default() };
    let [record] = records(file)[..] else { panic!("one record") };
    assert_eq!(Event::read(record), event);
}

/// A run that was killed at step 5, after its last checkpoint at step 3, writes steps 4 and 5 again.
#[test]
fn a_resumed_run_leaves_one_curve() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = EventFile::create(folder.path(), 0).unwrap();
    (1..=5).for_each(|step| first.write(step, &[("a/one", step as f64), ("two", -0.5)]).unwrap());
    let mut second = EventFile::create(folder.path(), 3).unwrap();
    (4..=300).for_each(|step| second.write(step, &[("a/one", 1000.0)]).unwrap());
    let scalars = read(folder.path());
    let expected: Vec<_> = (1..=300).map(|step| (step, if step > 3 { 1000.0 } else { step as f32 })).collect();
    assert_eq!(scalars["a/one"], expected);
    assert_eq!(scalars["two"], [(1, -0.5), (2, -0.5), (3, -0.5)]);
}

#[test]
fn a_run_says_what_its_tables_say() {
    let folder = tempfile::tempdir().unwrap();
    let mut train = assert_cmd::Command::new(assert_cmd::cargo::cargo_bin("train"));
    train.args(["--tensorboard", "--quiet", "--seed", "3", "--steps", "2000", "--set", "evaluate_every=1000"]);
    train.args(["--set", "evaluation_episodes=2", "--set", "learner.random_steps=500", "--set", "env.horizon=100"]);
    train.args(["--set", "learner.hidden=[16]", "--set", "learner.batch_size=8", "--out"]).arg(folder.path());
    train.assert().success();
    let run = folder.path().join("lift/aforce/seed_3");
    let scalars = read(&run);

    let column = |table: &str, name: &str| {
        let mut reader = csv::Reader::from_path(run.join(table)).unwrap();
        let headers = reader.headers().unwrap().clone();
        let [step, value] = ["step", name].map(|name| headers.iter().position(|h| h == name).unwrap());
        let row = |row: csv::StringRecord| (row[step].parse().unwrap(), row[value].parse().unwrap());
        reader.records().map(|record| row(record.unwrap())).collect::<Vec<(u64, f64)>>()
    };
    let same = |tag: &str, expected: &[(u64, f64)]| {
        let seen = &scalars[tag];
        assert_eq!(seen.len(), expected.len(), "{tag}");
        for (a, b) in seen.iter().zip(expected) {
            assert!(a.0 == b.0 && (f64::from(a.1) - b.1).abs() <= 1e-6 * b.1.abs(), "{tag}: {a:?} {b:?}");
        }
    };
    same("charts/episodic_return", &column("episodes.csv", "return"));
    same("energy/per_action_j", &column("episodes.csv", "energy_per_action_j"));
    same("contact/max_force_n", &column("episodes.csv", "max_contact_force_n"));
    same("charts/SPS", &column("progress.csv", "env_steps_per_s"));
    same("losses/alpha", &column("progress.csv", "alpha"));
    // Two episodes with mean actions, which are logged, and two with sampled ones.
    let rows = column("eval.csv", "return");
    let means: Vec<_> = rows.chunks(4).map(|rows| (rows[0].0, (rows[0].1 + rows[1].1) / 2.0)).collect();
    same("eval/episodic_return", &means);
}
