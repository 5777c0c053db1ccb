//! Checkpoints. A checkpoint is a folder from which a run continues with the same bits, and from which Python can read the weights.
//!
//! | file | content |
//! |---|---|
//! | `actor.safetensors` | the policy: `actor.0.weight` `(out, in)`, `actor.0.bias`, `actor.2.weight`, ...: a PyTorch `Sequential` of `Linear` and `ReLU` |
//! | `online_actor.safetensors` | the same for the actor that learns; the policy is a running mean of it |
//! | `critic.safetensors`, `target.safetensors` | the same for `critic_1` and `critic_2`; with `config.layer_norm` in `state.json` a `LayerNorm(elementwise_affine=False)` stands before each `ReLU` |
//! | `optimizer.safetensors` | Adam's moments (`.adam_m`, `.adam_v`) of `online_actor` and `critic`, and `log_temperature` with its own |
//! | `state.json` | sizes, settings, number of updates (which `actor.safetensors` repeats), states of the random generators, what the caller adds, BLAKE3 of the files above, and a checksum of itself |
//! | `replay.bin`, `replay_*.bin` | the replay memory with its own checksums, if saved; unchanged `replay_*.bin` are hard links to older ones |

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use fs_err as fs;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::buffer::Buffer;
use crate::network::{self, Entry, Networks};
use crate::synced_file;
use crate::tensor_file::{Tensors, write_tensors};
use crate::{Actor, Config, Error, Replay, Sac, Sizes, replay_file};

/// Version of the layout above.
const FORMAT: u32 = 1;
/// The file of the policy.
const POLICY: &str = "actor.safetensors";
/// The file of Adam's moments.
const OPTIMIZER: &str = "optimizer.safetensors";
/// The file of sizes, settings, counters and random generators.
const STATE: &str = "state.json";
/// Metadata key of the policy's file: its value, the number of updates, tells to which checkpoint the file belongs.
const UPDATES: &str = "updates";
/// Number of attempts to read a checkpoint while a run replaces it. The pause between attempts is longer than two renames take.
const TRIES: u32 = 10;
const PAUSE: Duration = Duration::from_millis(20);

/// Everything that [`Checkpoint::load`] finds.
#[derive(Debug)]
pub struct Checkpoint {
    /// The learner.
    pub sac: Sac,
    /// The replay memory, if it was saved.
    pub replay: Option<Replay>,
    /// What the caller saved, such as its step counter and the state of its environment.
    pub caller: Value,
}

#[derive(Serialize, Deserialize)]
struct State {
    /// BLAKE3 of this file's text, computed with zeros in place of this value. Older checkpoints lack it.
    checksum: Option<String>,
    format: u32,
    observation_dim: usize,
    /// Numbers that only the critics see.
    #[serde(default, skip_serializing_if = "is_zero")]
    privileged_dim: usize,
    action_dim: usize,
    updates: u64,
    config: Value,
    acting_rng: ChaCha8Rng,
    batch_rng: ChaCha8Rng,
    noise_rng: ChaCha8Rng,
    /// BLAKE3 of the tensor files, by name, to detect a damaged file and a file of another checkpoint. Older checkpoints have no hashes, or
    /// only that of the policy.
    #[serde(default)]
    hashes: BTreeMap<String, String>,
    #[serde(default, skip_serializing)]
    policy_hash: Option<String>,
    caller: Value,
}

impl Checkpoint {
    /// Writes a checkpoint to `folder`, in place of the one there. The new checkpoint is written to a folder beside the old one and then
    /// renamed, so that after a kill at any moment one of the two is complete.
    ///
    /// To continue with the same bits, save between episodes: after the last step of one and before [`Sac::begin_episode`] of the next.
    /// Pink noise and a nudge of a running episode are not saved. For evaluation alone a policy can be saved at any time.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] if the disk is full or not writable; the old checkpoint stays.
    pub fn save(folder: &Path, sac: &Sac, replay: Option<&Replay>, caller: Value) -> Result<(), Error> {
        let (new, old) = (beside(folder, "new"), beside(folder, "old"));
        if !folder.exists() && old.exists() {
            fs::rename(&old, folder)?;
        }
        for leftover in [&new, &old] {
            if leftover.exists() {
                fs::remove_dir_all(leftover)?;
            }
        }
        fs::create_dir_all(&new)?;
        // On an error, such as a full disk, the new folder is removed and the old checkpoint stays.
        write(&new, folder, sac, replay, caller).inspect_err(|_| drop(fs::remove_dir_all(&new)))?;
        if folder.exists() {
            fs::rename(folder, &old)?;
        }
        // After a kill here `current` finds the old checkpoint under its temporary name.
        fs::rename(&new, folder)?;
        if let Some(parent) = folder.parent() {
            synced_file::names(parent)?;
        }
        // On a network drive, files of the old checkpoint may remain while they are read. The next save removes them.
        let _ = fs::remove_dir_all(&old);
        Ok(())
    }

    /// Whether there is a checkpoint in `folder`, or beside it under the name that a kill during a save leaves.
    #[must_use]
    pub fn exists(folder: &Path) -> bool {
        current(folder).exists()
    }

    /// Reads the checkpoint in `folder`, to continue with `config` on a task with these sizes.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] or [`Error::Checkpoint`], in one line that names the file and says what is wrong: missing, damaged, made for
    /// other sizes, or with other settings. [`Error::Config`] if this process or processor cannot have the kernels that `config` asks for.
    pub fn load(folder: &Path, config: &Config, sizes: impl Into<Sizes>) -> Result<Self, Error> {
        let sizes = sizes.into();
        whole(folder, |folder| Self::read(folder, config, sizes))
    }

    fn read(folder: &Path, config: &Config, sizes: Sizes) -> Result<Self, Error> {
        let state = read_state(folder, sizes.observation, sizes.action)?;
        if state.privileged_dim != sizes.privileged {
            let problem = format!(
                "made for critics that see {} numbers more than the actor, not {}: another critic?",
                state.privileged_dim, sizes.privileged
            );
            return Err(Error::checkpoint(&folder.join(STATE), problem));
        }
        same_settings(&state.config, config).map_err(|problem| Error::checkpoint(&folder.join(STATE), problem))?;
        config.kernels.insist()?;
        let policy = read_policy(folder, &state, config)?;
        let mut sac = Sac::zeros(config, sizes);
        (sac.average, sac.updates) = (policy, state.updates);
        (sac.actor.rng, sac.batch_rng, sac.noise_rng) =
            (state.acting_rng.clone(), state.batch_rng.clone(), state.noise_rng.clone());

        let (actor, critics) = (sac.actor.network.entries(), sac.critics.entries());
        for (file, entries, values) in [
            ("online_actor.safetensors", &actor, &mut sac.actor.network.values),
            ("critic.safetensors", &critics, &mut sac.critics.values),
            ("target.safetensors", &critics, &mut sac.targets.values),
        ] {
            let tensors = Tensors::read(folder.join(file))?;
            values.copy_from_slice(&tensors.values(entries, "")?);
            state.names(file, &tensors)?;
        }
        let optimizer = Tensors::read(folder.join(OPTIMIZER))?;
        let temperature = log_temperature();
        let adams = [
            (&mut sac.actor_adam, &actor),
            (&mut sac.critic_adam, &critics),
            (&mut sac.temperature_adam, &temperature),
        ];
        for (adam, entries) in adams {
            adam.m = optimizer.values(entries, ".adam_m")?;
            adam.v = optimizer.values(entries, ".adam_v")?;
        }
        sac.log_temperature = optimizer.values(&temperature, "")?[0];
        state.names(OPTIMIZER, &optimizer)?;

        let replay = replay_file::exists(folder).then(|| replay_file::read(folder, config, sizes)).transpose()?;
        Ok(Self { sac, replay, caller: state.caller })
    }
}

impl Actor {
    /// Reads only the policy of the checkpoint in `folder`, and what the caller saved beside it. The policy's noise comes from `seed`.
    ///
    /// # Errors
    ///
    /// As [`Checkpoint::load`].
    pub fn load(folder: &Path, observation_dim: usize, action_dim: usize, seed: u64) -> Result<(Self, Value), Error> {
        whole(folder, |folder| {
            let state = read_state(folder, observation_dim, action_dim)?;
            let at = |problem: &dyn ToString| Error::checkpoint(&folder.join(STATE), problem.to_string());
            let config = Config::deserialize(&state.config).map_err(|e| at(&e))?;
            config.validate().map_err(|e| at(&e))?;
            // A learner in the same process may have chosen other kernels. That is accepted here: an action differs by rounding only, and
            // no run continues from it.
            config.kernels.choose()?;
            let policy = read_policy(folder, &state, &config)?;
            Ok((Self::new(&config, policy, ChaCha8Rng::seed_from_u64(seed)), state.caller))
        })
    }
}

/// Writes the folder of a checkpoint. `before` is the checkpoint that the new one will replace.
fn write(folder: &Path, before: &Path, sac: &Sac, replay: Option<&Replay>, caller: Value) -> Result<(), Error> {
    let (actor, critics, temperature) = (sac.actor.network.entries(), sac.critics.entries(), log_temperature());
    let mut hashes = BTreeMap::new();
    let mut write = |name: &str, groups: &[(&[Entry], &str, &[f32])], note| {
        let hash = write_tensors(&folder.join(name), groups, note)?;
        hashes.insert(name.to_string(), hash.to_hex().to_string());
        Ok::<_, Error>(())
    };
    write(POLICY, &[(&actor, "", &sac.average.values)], Some((UPDATES, sac.updates.to_string())))?;
    write("online_actor.safetensors", &[(&actor, "", &sac.actor.network.values)], None)?;
    write("critic.safetensors", &[(&critics, "", &sac.critics.values)], None)?;
    write("target.safetensors", &[(&critics, "", &sac.targets.values)], None)?;
    let optimizer: [(&[Entry], &str, &[f32]); 7] = [
        (&actor, ".adam_m", &sac.actor_adam.m),
        (&actor, ".adam_v", &sac.actor_adam.v),
        (&critics, ".adam_m", &sac.critic_adam.m),
        (&critics, ".adam_v", &sac.critic_adam.v),
        (&temperature, ".adam_m", &sac.temperature_adam.m),
        (&temperature, ".adam_v", &sac.temperature_adam.v),
        (&temperature, "", std::slice::from_ref(&sac.log_temperature)),
    ];
    write(OPTIMIZER, &optimizer, None)?;
    if let Some(replay) = replay {
        replay_file::write(folder, before, replay)?;
    }
    let state = State {
        checksum: Some(unsummed()),
        format: FORMAT,
        observation_dim: sac.sizes.observation,
        privileged_dim: sac.sizes.privileged,
        action_dim: sac.sizes.action,
        updates: sac.updates,
        config: serde_json::to_value(&sac.config).expect("plain data"),
        acting_rng: sac.actor.rng.clone(),
        batch_rng: sac.batch_rng.clone(),
        noise_rng: sac.noise_rng.clone(),
        hashes,
        policy_hash: None,
        caller,
    };
    let text = serde_json::to_string_pretty(&state).expect("plain data");
    let summed = text.replacen(&unsummed(), &checksum(&text), 1);
    synced_file::write(&folder.join(STATE), summed.as_bytes())?;
    synced_file::names(folder)
}

/// Placeholder for the checksum of `state.json` while that is computed.
fn unsummed() -> String {
    "0".repeat(2 * blake3::OUT_LEN)
}

fn checksum(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

impl State {
    /// An error if a file is not the one that this state was saved with. States of older versions may lack the file's hash.
    fn names(&self, file: &str, tensors: &Tensors) -> Result<(), Error> {
        let hash = self.hashes.get(file).or(self.policy_hash.as_ref().filter(|_| file == POLICY));
        match hash {
            Some(hash) if *hash != tensors.hash() => Err(Error::checkpoint(
                &tensors.path,
                format!("not the file that {STATE} beside it names: damaged, or of another checkpoint"),
            )),
            _ => Ok(()),
        }
    }
}

fn is_zero(number: &usize) -> bool {
    *number == 0
}

fn read_state(folder: &Path, observation_dim: usize, action_dim: usize) -> Result<State, Error> {
    let path = folder.join(STATE);
    let text = fs::read_to_string(&path)?;
    let state: State = serde_json::from_str(&text).map_err(|e| Error::checkpoint(&path, e))?;
    if state.checksum.as_ref().is_some_and(|sum| checksum(&text.replacen(sum.as_str(), &unsummed(), 1)) != *sum) {
        return Err(Error::checkpoint(&path, "its checksum does not agree: damaged, or changed by hand"));
    }
    if state.format != FORMAT {
        return Err(Error::checkpoint(&path, format!("format {}, this program reads {FORMAT}", state.format)));
    }
    if (state.observation_dim, state.action_dim) != (observation_dim, action_dim) {
        let problem = format!(
            "made for {} observations and {} actions, not for {observation_dim} and {action_dim}: another task or action space?",
            state.observation_dim, state.action_dim
        );
        return Err(Error::checkpoint(&path, problem));
    }
    Ok(state)
}

/// Reads the policy that `state` belongs to. An error if it has another number of updates or another hash than `state`
/// says; files of older checkpoints may lack either.
fn read_policy(folder: &Path, state: &State, config: &Config) -> Result<Networks, Error> {
    let path = folder.join(POLICY);
    let file = Tensors::read(path.clone())?;
    let updates = state.updates.to_string();
    if let Some(other) = file.metadata(UPDATES)?.filter(|other| *other != updates) {
        let problem = format!("has seen {other} updates, {STATE} beside it {updates}");
        return Err(Error::checkpoint(&path, problem));
    }
    let sizes = Actor::sizes(config, state.observation_dim, state.action_dim);
    // Compared before any network is allocated: wrong settings must not allocate memory.
    let values = file.values(&network::entries(Actor::NAMES, &sizes), "")?;
    state.names(POLICY, &file)?;
    Ok(Networks::with_values(Actor::NAMES, &sizes, Buffer::from_slice(&values)))
}

/// An error, which names the first difference, if the settings are not those with which a checkpoint was saved. A setting that the saved
/// file lacks counts as off.
fn same_settings(saved: &Value, config: &Config) -> Result<(), String> {
    let saved: Config = serde_json::from_value(saved.clone()).map_err(|e| e.to_string())?;
    let [saved, wanted] = [&saved, config].map(|config| serde_json::to_value(config).expect("plain data"));
    let wanted = wanted.as_object().expect("a struct");
    match wanted.iter().find(|(key, here)| saved[key.as_str()] != **here) {
        None => Ok(()),
        Some((key, here)) => {
            let there = &saved[key.as_str()];
            Err(format!("saved with other settings of the learner ({key}: there {there}, here {here})"))
        }
    }
}

/// Calls `read` with the folder of a checkpoint. A run that saves meanwhile renames that folder, so that `read` may see parts of two
/// checkpoints or no folder; `read` is then called again. If the folder was not replaced, an error is the checkpoint's own.
fn whole<T>(folder: &Path, read: impl Fn(&Path) -> Result<T, Error>) -> Result<T, Error> {
    let place = || {
        let path = current(folder);
        fs::metadata(&path).ok().map(|folder| (path, folder.ino()))
    };
    for _ in 1..TRIES {
        let before = place();
        let found = read(&current(folder));
        if found.is_ok() || before.is_some() && before == place() {
            return found;
        }
        std::thread::sleep(PAUSE);
    }
    read(&current(folder))
}

/// The folder of the checkpoint. A kill between the two renames of a save leaves the checkpoint under a temporary name. Readers use that
/// name and rename nothing, because a save may be running.
fn current(folder: &Path) -> PathBuf {
    let old = beside(folder, "old");
    if !folder.exists() && old.exists() { old } else { folder.into() }
}

/// `runs/checkpoints/last` -> `runs/checkpoints/.last.new`.
fn beside(folder: &Path, what: &str) -> PathBuf {
    folder.with_file_name(format!(".{}.{what}", folder.file_name().unwrap_or_default().display()))
}

fn log_temperature() -> Vec<Entry> {
    vec![Entry { name: "log_temperature".into(), offset: 0, shape: vec![1] }]
}
