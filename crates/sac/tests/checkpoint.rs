//! A run that is saved, loaded and continued gives the same bytes, and a damaged file is refused by name.

use std::fs;
use std::path::Path;

use sac::{Act, Actor, Checkpoint, Config, Replay, Sac, Sizes, Transition};
use serde_json::{Value, json};

const OBSERVATIONS: usize = 5;
const ACTIONS: usize = 2;
const PLAIN: Sizes = Sizes { observation: OBSERVATIONS, privileged: 0, action: ACTIONS };
/// Two of the numbers are seen by the critics alone.
const ASYMMETRIC: Sizes = Sizes { observation: OBSERVATIONS - 2, privileged: 2, action: ACTIONS };

fn config() -> Config {
    Config { hidden: vec![32, 16], batch_size: 16, target_period: 2, replay_capacity: 150, ..Config::default() }
}

/// Options that are off in [`config`]. Some of the episodes have pink noise and nudges.
fn options() -> Config {
    Config { actor_period: 2, layer_norm: true, pink_noise: 0.75, nudges: 0.75, prior_episodes: 5, ..config() }
}

fn start() -> (Sac, Replay) {
    start_with(&config(), PLAIN)
}

fn start_with(config: &Config, sizes: Sizes) -> (Sac, Replay) {
    let mut sac = Sac::new(config, sizes, 11).unwrap();
    let mut replay = Replay::new(config, sizes);
    // More steps than the memory holds, so that the oldest have been replaced.
    (0..200).for_each(|k| step(&mut sac, &mut replay, k));
    (sac, replay)
}

fn step(sac: &mut Sac, replay: &mut Replay, k: usize) {
    if k.is_multiple_of(40) || k.is_multiple_of(30) {
        sac.begin_episode();
    }
    let observe = |k: usize| std::array::from_fn::<f32, OBSERVATIONS, _>(|i| ((7 * k + i) as f32).sin());
    let mut action = [0.0; ACTIONS];
    sac.act(&observe(k)[..sac.sizes().observation], &mut action, Act::Sample);
    let transition = Transition {
        observation: &observe(k),
        action: &action,
        reward: action[0],
        next_observation: &observe(k + 1),
        terminated: k % 40 == 39,
        truncated: k % 30 == 29,
    };
    replay.push(&transition).unwrap();
}

fn go_on(sac: &mut Sac, replay: &mut Replay, steps: std::ops::Range<usize>) {
    // The prior episodes are not saved; a run that continues makes them again.
    let prior = (sac.config().prior_episodes > 0).then(|| start().1);
    for k in steps {
        step(sac, replay, k);
        match &prior {
            Some(prior) => sac.update_with_prior(replay, prior),
            None => sac.update(replay),
        };
    }
}

/// Every byte that decides how the run continues.
fn bytes(folder: &Path, sac: &Sac, replay: &Replay) -> Vec<(String, Vec<u8>)> {
    Checkpoint::save(folder, sac, Some(replay), json!({ "step": 1 })).unwrap();
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    files.iter().map(|path| (path.file_name().unwrap().display().to_string(), fs::read(path).unwrap())).collect()
}

#[test]
fn a_continued_run_gives_the_bytes_of_an_unbroken_one() {
    same_bytes(&config(), PLAIN, 240);
    same_bytes(&options(), PLAIN, 240);
    same_bytes(&options(), ASYMMETRIC, 240);
}

/// Without pink noise and nudges, the only state of a running episode is the steps that wait for their rewards, and those are saved.
#[test]
fn with_white_noise_a_run_may_be_saved_within_an_episode() {
    same_bytes(&config(), PLAIN, 251);
}

/// Compares a run that continues from a checkpoint at step `at` with one that was not stopped, up to step 300.
fn same_bytes(config: &Config, sizes: Sizes, at: usize) {
    let folder = tempfile::tempdir().unwrap();
    let (mut sac, mut replay) = start_with(config, sizes);
    go_on(&mut sac, &mut replay, 200..at);
    let caller = json!({ "step": at, "x": 0.1 + 0.2 });
    Checkpoint::save(&folder.path().join("last"), &sac, Some(&replay), caller.clone()).unwrap();
    go_on(&mut sac, &mut replay, at..300);

    let loaded = Checkpoint::load(&folder.path().join("last"), config, sizes).unwrap();
    assert_eq!(loaded.caller, caller);
    let (mut sac_2, mut replay_2) = (loaded.sac, loaded.replay.unwrap());
    assert_eq!((sac_2.updates(), sac_2.config()), (at as u64 - 200, config));
    go_on(&mut sac_2, &mut replay_2, at..300);

    assert_eq!(replay, replay_2);
    let (straight, resumed) =
        (bytes(&folder.path().join("a"), &sac, &replay), bytes(&folder.path().join("b"), &sac_2, &replay_2));
    assert_eq!(straight.len(), 7);
    for (a, b) in straight.iter().zip(&resumed) {
        assert!(a == b, "{} differs", a.0);
    }
}

#[test]
fn a_checkpoint_plays_the_learners_policy() {
    let folder = tempfile::tempdir().unwrap();
    let (mut sac, mut replay) = start();
    go_on(&mut sac, &mut replay, 200..210);
    Checkpoint::save(folder.path(), &sac, None, json!({ "task": "door" })).unwrap();
    assert!(Checkpoint::load(folder.path(), &config(), (OBSERVATIONS, ACTIONS)).unwrap().replay.is_none());
    let (mut actor, caller) = Actor::load(folder.path(), OBSERVATIONS, ACTIONS, 1).unwrap();
    assert_eq!(caller, json!({ "task": "door" }));
    let (mut a, mut b) = ([0.0; ACTIONS], [0.0; ACTIONS]);
    sac.policy(0).act(&[0.1; OBSERVATIONS], &mut a, Act::Mean);
    actor.act(&[0.1; OBSERVATIONS], &mut b, Act::Mean);
    assert_eq!(a, b);
    sac.act(&[0.1; OBSERVATIONS], &mut b, Act::Mean);
    assert_ne!(a, b, "the actor that learns is another");
}

#[test]
fn names_and_shapes_are_those_of_a_pytorch_sequential() {
    let folder = tempfile::tempdir().unwrap();
    let (sac, _) = start();
    Checkpoint::save(folder.path(), &sac, None, Value::Null).unwrap();
    let shapes = |file: &str| {
        let bytes = fs::read(folder.path().join(file)).unwrap();
        let file = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        let mut shapes: Vec<String> =
            file.tensors().iter().map(|(name, t)| format!("{name} {:?}", t.shape())).collect();
        shapes.sort();
        shapes
    };
    let actor =
        ["0.bias [32]", "0.weight [32, 5]", "2.bias [16]", "2.weight [16, 32]", "4.bias [4]", "4.weight [4, 16]"];
    assert_eq!(shapes("actor.safetensors"), actor.map(|name| format!("actor.{name}")));
    assert_eq!(shapes("critic.safetensors").len(), 12);
    assert!(shapes("critic.safetensors").contains(&"critic_2.0.weight [32, 7]".to_string()));
    assert!(shapes("optimizer.safetensors").contains(&"critic_2.4.weight.adam_v [1, 16]".to_string()));
}

#[test]
fn a_missing_damaged_or_foreign_checkpoint_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("last");
    let message = |observations| {
        let message = Checkpoint::load(&path, &config(), (observations, ACTIONS)).unwrap_err().to_string();
        assert!(!message.contains('\n'), "{message}");
        message
    };
    assert!(message(OBSERVATIONS).contains("last/state.json"), "{}", message(OBSERVATIONS));

    let (sac, replay) = start();
    Checkpoint::save(&path, &sac, Some(&replay), Value::Null).unwrap();
    let foreign = message(OBSERVATIONS + 1);
    assert!(
        foreign.ends_with("made for 5 observations and 2 actions, not for 6 and 2: another task or action space?"),
        "{foreign}"
    );

    for (file, complaint) in [
        ("actor.safetensors", "damaged or cut off"),
        ("online_actor.safetensors", "damaged or cut off"),
        ("critic.safetensors", "damaged or cut off"),
        ("target.safetensors", "damaged or cut off"),
        ("optimizer.safetensors", "damaged or cut off"),
        ("replay.bin", "damaged or cut off"),
        ("state.json", "EOF"),
    ] {
        let whole = fs::read(path.join(file)).unwrap();
        fs::write(path.join(file), &whole[..whole.len() - 20]).unwrap();
        let cut = message(OBSERVATIONS);
        assert!(cut.contains(&format!("last/{file}: ")) && cut.contains(complaint), "{file}: {cut}");
        fs::write(path.join(file), []).unwrap();
        assert!(message(OBSERVATIONS).contains(&format!("last/{file}: ")), "{file}: {}", message(OBSERVATIONS));
        fs::write(path.join(file), whole).unwrap();
    }
    let whole = fs::read(path.join("replay.bin")).unwrap();
    let mut flipped = whole.clone();
    flipped[1000] ^= 1;
    fs::write(path.join("replay.bin"), flipped).unwrap();
    assert!(message(OBSERVATIONS).ends_with("last/replay.bin: the checksum does not agree: damaged or cut off"));
    fs::write(path.join("replay.bin"), [b"SACRPLY1", &whole[8..]].concat()).unwrap();
    assert!(
        message(OBSERVATIONS).contains("of an earlier version, which this one cannot go on from: begin the run anew")
    );
    fs::write(path.join("replay.bin"), whole).unwrap();

    // A flipped bit after which every number is still finite.
    for file in ["actor", "online_actor", "critic", "target", "optimizer"] {
        let file = format!("{file}.safetensors");
        let whole = fs::read(path.join(&file)).unwrap();
        let mut flipped = whole.clone();
        let last = flipped.len() - 4;
        flipped[last] ^= 1;
        fs::write(path.join(&file), flipped).unwrap();
        let expected =
            format!("last/{file}: not the file that state.json beside it names: damaged, or of another checkpoint");
        assert!(message(OBSERVATIONS).ends_with(&expected), "{}", message(OBSERVATIONS));
        fs::write(path.join(&file), whole).unwrap();
    }
    let whole = fs::read_to_string(path.join("state.json")).unwrap();
    fs::write(path.join("state.json"), whole.replacen("\"updates\": 0", "\"updates\": 8", 1)).unwrap();
    assert!(
        message(OBSERVATIONS).ends_with("last/state.json: its checksum does not agree: damaged, or changed by hand")
    );
    fs::write(path.join("state.json"), whole).unwrap();
    Checkpoint::load(&path, &config(), (OBSERVATIONS, ACTIONS)).unwrap();

    // A weight of another shape.
    fs::copy(path.join("critic.safetensors"), path.join("actor.safetensors")).unwrap();
    assert!(message(OBSERVATIONS).ends_with("last/actor.safetensors: holds no actor.0.weight"));
}

/// A run continues only with the settings that its checkpoint was saved with. A setting that the file lacks counts as off, whatever today's
/// default is.
#[test]
fn a_checkpoint_goes_on_with_the_settings_it_was_saved_with() {
    let folder = tempfile::tempdir().unwrap();
    let (sac, replay) = start();
    Checkpoint::save(folder.path(), &sac, Some(&replay), Value::Null).unwrap();
    let load = |config: &Config| Checkpoint::load(folder.path(), config, (OBSERVATIONS, ACTIONS));
    let refused = |config: &Config| load(config).unwrap_err().to_string();
    let other = Config { gamma: 0.5, ..config() };
    assert!(refused(&other).ends_with("(gamma: there 0.97, here 0.5)"), "{}", refused(&other));

    let path = folder.path().join("state.json");
    let mut state: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    state["config"].as_object_mut().unwrap().remove("policy_average").unwrap();
    state["checksum"] = Value::Null;
    fs::write(&path, state.to_string()).unwrap();
    assert!(refused(&config()).ends_with("(policy_average: there 1.0, here 0.0003)"), "{}", refused(&config()));
    Actor::load(folder.path(), OBSERVATIONS, ACTIONS, 0).unwrap();
}

/// Layers that would take gigabytes are compared with those of the file before they are allocated.
#[test]
fn layers_that_are_not_the_files_are_refused_before_they_are_made() {
    let folder = tempfile::tempdir().unwrap();
    Checkpoint::save(folder.path(), &start().0, None, Value::Null).unwrap();
    let path = folder.path().join("state.json");
    let mut state: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let mut refused = |hidden: &[usize]| {
        state["config"]["hidden"] = json!(hidden);
        state["checksum"] = Value::Null;
        fs::write(&path, state.to_string()).unwrap();
        Actor::load(folder.path(), OBSERVATIONS, ACTIONS, 0).unwrap_err().to_string()
    };
    let large = refused(&[16_384, 4096]);
    assert!(large.ends_with("actor.safetensors: actor.0.weight is F32 [32, 5], not F32 [16384, 5]"), "{large}");
    let deep = refused(&[32; 9]);
    assert!(deep.ends_with("is out of range: one to eight layers of 1 to 16384 units"), "{deep}");
}

/// What a reader may find between the two renames of a save: the state of one checkpoint and the policy of another.
#[test]
fn parts_of_two_checkpoints_are_not_put_together() {
    let folder = tempfile::tempdir().unwrap();
    let [mixed, newer] = ["mixed", "newer"].map(|name| folder.path().join(name));
    let (mut sac, mut replay) = start();
    Checkpoint::save(&mixed, &sac, None, Value::Null).unwrap();
    go_on(&mut sac, &mut replay, 200..210);
    Checkpoint::save(&newer, &sac, None, Value::Null).unwrap();
    fs::copy(newer.join("actor.safetensors"), mixed.join("actor.safetensors")).unwrap();
    let load = || Actor::load(&mixed, OBSERVATIONS, ACTIONS, 0).map(|_| ());
    let error = load().unwrap_err().to_string();
    assert!(error.ends_with("actor.safetensors: has seen 10 updates, state.json beside it 0"), "{error}");
}

/// As when `evaluate` reads a run that trains: at any moment the reader finds one complete checkpoint.
#[test]
fn a_reader_finds_a_whole_checkpoint_while_a_run_saves_itself() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("last");
    let (mut sac, mut replay) = start();
    Checkpoint::save(&path, &sac, None, Value::Null).unwrap();
    std::thread::scope(|scope| {
        let writer = scope.spawn(|| {
            for step in 200..220 {
                go_on(&mut sac, &mut replay, step..step + 1);
                Checkpoint::save(&path, &sac, None, Value::Null).unwrap();
                std::thread::sleep(std::time::Duration::from_millis(30));
            }
        });
        while !writer.is_finished() {
            Actor::load(&path, OBSERVATIONS, ACTIONS, 0).unwrap();
        }
    });
}

/// What a kill between the two renames of a save leaves: the old folder under its temporary name, and beside it the new one, complete.
#[test]
fn a_save_that_was_killed_leaves_a_whole_checkpoint() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("last");
    let (mut sac, mut replay) = start();
    Checkpoint::save(&path, &sac, Some(&replay), json!("old")).unwrap();
    go_on(&mut sac, &mut replay, 200..210);
    Checkpoint::save(&folder.path().join(".last.new"), &sac, Some(&replay), json!("new")).unwrap();
    // Killed before the renames: the old checkpoint counts.
    assert_eq!(Checkpoint::load(&path, &config(), (OBSERVATIONS, ACTIONS)).unwrap().caller, json!("old"));
    // Killed between the renames.
    fs::rename(&path, folder.path().join(".last.old")).unwrap();
    assert!(Checkpoint::exists(&path));
    assert_eq!(Checkpoint::load(&path, &config(), (OBSERVATIONS, ACTIONS)).unwrap().caller, json!("old"));
    assert_eq!(Actor::load(&path, OBSERVATIONS, ACTIONS, 0).unwrap().1, json!("old"));
    assert!(!path.exists(), "who reads must not come in the way of a run that is between its renames");
    // The next save removes what the kill left.
    Checkpoint::save(&path, &sac, Some(&replay), json!("newer")).unwrap();
    assert_eq!(Checkpoint::load(&path, &config(), (OBSERVATIONS, ACTIONS)).unwrap().caller, json!("newer"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no leftovers");
}

/// The actor of a run can be loaded without what only its critics saw. To continue the run, the critics have to see it again.
#[test]
fn critics_that_see_more_are_not_taken_for_others() {
    let folder = tempfile::tempdir().unwrap();
    let (mut sac, mut replay) = start_with(&config(), ASYMMETRIC);
    go_on(&mut sac, &mut replay, 200..220);
    Checkpoint::save(folder.path(), &sac, Some(&replay), Value::Null).unwrap();
    let (actor, _) = Actor::load(folder.path(), ASYMMETRIC.observation, ACTIONS, 0).unwrap();
    assert_eq!(actor.observation_dim(), OBSERVATIONS - 2);
    let refused = Checkpoint::load(folder.path(), &config(), (ASYMMETRIC.observation, ACTIONS)).unwrap_err();
    let expected = "state.json: made for critics that see 2 numbers more than the actor, not 0: another critic?";
    assert!(refused.to_string().ends_with(expected), "{refused}");
}
