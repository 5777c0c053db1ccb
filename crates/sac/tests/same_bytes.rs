//! A run gives the same bytes on another processor. glibc and MKL choose functions by the processor's instructions. Neither choice may
//! change a learner with portable kernels, and with fast kernels only MKL's may.

use std::process::Command;

use sac::{Act, Checkpoint, Config, Kernels, Preset, Replay, Sac, Transition};

/// Set in a child process, which prints what its parent compares: kernels are decided on once per process.
const CHILD: &str = "SAME_BYTES_CHILD";

/// Makes glibc (2.33 or later) choose functions as on a processor without these instructions.
const OLDER_FOR_GLIBC: (&str, &str) = ("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F");
/// The same for MKL.
const OLDER_FOR_MKL: (&str, &str) = ("MKL_ENABLE_INSTRUCTIONS", "SSE4_2");

/// Hash of every byte of a checkpoint after 150 updates.
fn digest(kernels: Kernels) -> String {
    let swift = Preset::SWIFT.settings();
    let config = Config { kernels, batch_size: 32, random_steps: 50, updates_per_step: 1.0, pink_noise: 1.0, ..swift };
    let config = Config { layer_norm: true, ..config };
    let mut sac = Sac::new(&config, (5, 3), 7).unwrap();
    let mut replay = Replay::new(&config, (5, 3));
    let observe = |k: u64| std::array::from_fn::<f32, 5, _>(|i| ((7 * k + i as u64) % 13) as f32 / 13.0);
    let mut action = [0.0; 3];
    for k in 1..=200 {
        if k % 20 == 1 {
            sac.begin_episode();
        }
        sac.act(&observe(k), &mut action, if k <= config.random_steps { Act::Random } else { Act::Sample });
        let transition = Transition {
            observation: &observe(k),
            action: &action,
            reward: action[0],
            next_observation: &observe(k + 1),
            terminated: k % 40 == 0,
            truncated: k % 20 == 0,
        };
        replay.push(&transition).unwrap();
        (0..config.updates_after(k)).for_each(|_| assert!(sac.update(&replay).is_finite()));
    }
    let folder = tempfile::tempdir().unwrap();
    Checkpoint::save(folder.path(), &sac, Some(&replay), serde_json::Value::Null).unwrap();
    let mut files: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    let mut hash = blake3::Hasher::new();
    for path in &files {
        hash.update(&std::fs::read(path).unwrap());
    }
    hash.finalize().to_hex().to_string()
}

/// A hash of values of the platform's own sine, which do depend on glibc's choice.
fn platforms_sine() -> String {
    let mut hash = blake3::Hasher::new();
    for i in 0..100_000 {
        hash.update(&(1e-3 * f64::from(i)).sin().to_bits().to_le_bytes());
    }
    hash.finalize().to_hex().to_string()
}

/// What a process of its own computes in this environment: the digest, and the name of the kernel.
fn in_child(kernels: &str, environment: &[(&str, &str)]) -> [String; 2] {
    let [digest, kernel, _] = told_by_child(kernels, environment);
    [digest, kernel]
}

/// The same, and the hash of the platform's sine.
fn told_by_child(kernels: &str, environment: &[(&str, &str)]) -> [String; 3] {
    let mut child = Command::new(std::env::current_exe().unwrap());
    child.args(["--exact", "child", "--nocapture"]).env(CHILD, kernels).envs(environment.iter().copied());
    let output = String::from_utf8(child.output().unwrap().stdout).unwrap();
    ["digest ", "kernel ", "sine "].map(|what| {
        let line = output.lines().find_map(|line| line.split_once(what));
        line.unwrap_or_else(|| panic!("no {what}in {output}")).1.to_string()
    })
}

/// Does nothing unless a parent process sets [`CHILD`].
#[test]
fn child() {
    if let Ok(kernels) = std::env::var(CHILD) {
        let kernels = serde_json::from_value(kernels.into()).unwrap();
        println!("\ndigest {}", digest(kernels));
        println!("kernel {}", sac::kernel());
        println!("sine {}", platforms_sine());
    }
}

#[test]
fn the_platforms_mathematics_has_no_part() {
    let [here, older] = [told_by_child("fast", &[]), told_by_child("fast", &[OLDER_FOR_GLIBC])];
    if is_x86_feature_detected!("fma") && cfg!(target_env = "gnu") {
        assert!(here[2] != older[2], "glibc did not take other instructions: nothing was tested");
    }
    assert_eq!(here[..2], older[..2]);
}

#[test]
fn portable_kernels_are_the_same_on_an_older_processor() {
    let portable = in_child("portable", &[]);
    assert_eq!(portable, in_child("portable", &[OLDER_FOR_GLIBC, OLDER_FOR_MKL]));
    // Fast kernels are not the same there, which shows that MKL did take other ones.
    let [[digest, kernel], [older_digest, older_kernel]] = [in_child("fast", &[]), in_child("fast", &[OLDER_FOR_MKL])];
    if is_x86_feature_detected!("avx2") {
        assert!(digest != older_digest, "{kernel}");
    }
    // On a processor that is not Intel's, MKL reports the same name whatever kernels it uses.
    let is_intel = std::fs::read_to_string("/proc/cpuinfo").unwrap().contains("GenuineIntel");
    if is_intel {
        assert!(kernel != portable[1], "{kernel}");
        assert!(!is_x86_feature_detected!("avx2") || kernel != older_kernel, "{kernel}");
    }
}
