use super::*;

/// A load that no joint can bear ends the episode, even where its horizon would have.
#[test]
fn a_divergence_ends_the_episode_and_earns_nothing() {
    for horizon in [500, 3] {
        let mut env = Env::new(EnvConfig { horizon, ..EnvConfig::default() }, 1).unwrap();
        let start = env.reset(Some(1)).to_vec();
        let action = vec![0.5; env.action_dim()];
        for _ in 0..2 {
            let step = env.step(&action);
            assert!(!step.terminated && !step.diverged && step.reward > 0.0);
        }
        let before = env.observation().to_vec();
        env.simulation.set_load(6, 1e6);
        let step = env.step(&action);
        assert!(step.terminated && step.diverged && !step.truncated && !step.success);
        assert_eq!((step.reward, step.reward_terms), (0.0, [0.0; REWARD_TERMS]));
        assert_eq!(env.observation(), before, "the last valid one stays");
        // The next episode begins as if nothing had happened.
        assert_eq!(env.reset(Some(1)), start);
    }
}
