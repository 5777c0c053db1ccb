//! Where a run came from: `manifest.json`.

use anyhow::{Context, Result, ensure};
use output::file;
use serde::{Deserialize, Serialize};

use crate::config::RunConfig;
use crate::run::clock::Spent;
use crate::run::folder::RunFolder;

/// A process that resumed a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Continuation {
    /// From this training action on.
    pub step: u64,
    /// As in [`Manifest`].
    pub commit: String,
    /// As in [`Manifest`].
    pub command: Vec<String>,
    /// As in [`Manifest`].
    #[serde(default)]
    pub kernel: String,
}

/// Where a run came from: `manifest.json`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of this file.
    pub schema: u32,
    /// The command line that started the run, program name first.
    pub command: Vec<String>,
    /// Commit of the checkout the program was built in, with `-dirty` if it was changed.
    pub commit: String,
    /// The processes that resumed the run with another commit, command or kernel than before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub continued: Vec<Continuation>,
    /// Hash of the configuration.
    pub config_hash: String,
    /// Seed of the run.
    pub seed: u64,
    /// Processor model.
    pub cpu: String,
    /// The learner's setting `kernels`; `kernel` is what libtorch's MKL says that it took. Both are empty in older
    /// manifests. Another kernel changes the last bits of numbers.
    #[serde(default)]
    pub kernels: String,
    /// See `kernels`.
    #[serde(default)]
    pub kernel: String,
    /// Version of this program.
    pub version: String,
    /// Start, seconds since 1970.
    pub started_unix_s: u64,
    /// `running`, `stopped`, `failed` or `done`; a run that was killed stays `running`.
    pub status: String,
    /// Time of all processes that trained the run.
    #[serde(flatten)]
    pub spent: Spent,
}

impl RunFolder {
    /// Writes the manifest.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write_manifest(&self, manifest: &Manifest) -> Result<()> {
        let path = self.path().join("manifest.json");
        let text = serde_json::to_string_pretty(manifest).context("manifest")?;
        file::replace(&path, (text + "\n").as_bytes())
    }

    /// Writes and returns the manifest of a run that begins, or resumes at `step`.
    ///
    /// # Errors
    /// If an existing manifest is damaged or has another configuration, or if it cannot be written.
    pub fn begin_manifest(&self, config: &RunConfig, step: u64) -> Result<Manifest> {
        let mut manifest = Manifest::start(config);
        if step > 0 {
            let Manifest { commit, command, kernel, .. } = manifest;
            manifest = self.manifest()?;
            let last = manifest.continued.last();
            let begun = (&manifest.commit, &manifest.command, &manifest.kernel);
            let known = last.map_or(begun, |last| (&last.commit, &last.command, &last.kernel));
            // Another version of the program may have other settings, and so another hash.
            let same_program = *known.0 == commit && manifest.version == env!("CARGO_PKG_VERSION");
            ensure!(
                !same_program || manifest.config_hash == config.hash(),
                "{}: is not what the run was begun with: it was changed since, or the program was. Put it back, or begin another run",
                self.config().display()
            );
            manifest.config_hash = config.hash();
            if known != (&commit, &command, &kernel) {
                manifest.continued.push(Continuation { step, commit, command, kernel });
            }
            manifest.status = "running".into();
        }
        self.write_manifest(&manifest)?;
        Ok(manifest)
    }

    /// Reads the manifest.
    ///
    /// # Errors
    /// If it is missing or damaged.
    pub fn manifest(&self) -> Result<Manifest> {
        let path = self.path().join("manifest.json");
        serde_json::from_str(&fs_err::read_to_string(&path)?).with_context(|| format!("{}", path.display()))
    }
}

impl Manifest {
    /// Every commit that had a part in the run, in order.
    pub fn commits(&self) -> String {
        let mut commits = vec![self.commit.as_str()];
        commits.extend(self.continued.iter().map(|part| part.commit.as_str()));
        commits.dedup();
        commits.join(" ")
    }

    /// The manifest of a run of which only the seed is known.
    pub fn unknown(seed: u64) -> Self {
        Manifest {
            schema: 1,
            command: vec![],
            commit: String::new(),
            continued: vec![],
            config_hash: String::new(),
            seed,
            cpu: String::new(),
            kernels: String::new(),
            kernel: String::new(),
            version: String::new(),
            started_unix_s: 0,
            status: "done".into(),
            spent: Spent::default(),
        }
    }

    /// The manifest of a run that starts now. The learner has to be made before, because `kernel` is what libtorch chose for it.
    pub fn start(config: &RunConfig) -> Self {
        let since_1970 = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        Manifest {
            schema: 1,
            command: output::command(),
            commit: output::commit(),
            continued: vec![],
            config_hash: config.hash(),
            seed: config.seed,
            cpu: cpu_model(),
            kernels: format!("{:?}", config.learner.kernels).to_lowercase(),
            kernel: sac::kernel(),
            version: env!("CARGO_PKG_VERSION").into(),
            started_unix_s: since_1970.map_or(0, |t| t.as_secs()),
            status: "running".into(),
            spent: Spent::default(),
        }
    }
}

fn cpu_model() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    model.map_or("unknown".into(), |(_, name)| name.trim().to_string())
}
