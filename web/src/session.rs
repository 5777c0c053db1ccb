//! A live episode: its player, a hand that pulls, and the state that is shown after every few control samples.

use aforce::{Pose, Vector3};
use physics::Push;
use serde::Deserialize;
use serde_json::{Value, json};
use tasks::{Env, Sample, Step};

use crate::setup::{Knob, Player, Setup, sentence};

/// The hand is a spring between a point of the arm and the mouse: its stiffness (N/m), and its largest force (N).
const PULL_STIFFNESS: f64 = 400.0;
const STRONGEST_PULL: f64 = 60.0;

/// What the hand does.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hand {
    /// Pulls a point of a body (m, in the body's frame) towards a place (m, world).
    Pull {
        /// Index of the body.
        body: usize,
        /// The point.
        point: [f64; 3],
        /// The place.
        to: [f64; 3],
    },
    /// Pushes the tool point with a force (N, world).
    Force([f64; 3]),
}

/// A live episode.
pub struct Session {
    env: Env,
    player: Player,
    knobs: Vec<Knob>,
    setup: Setup,
    hand: Option<Hand>,
    /// Whether an action is under way.
    acting: bool,
    /// Time since the start (s), and the energy of the joints since then (J).
    time: f64,
    energy: f64,
    /// Sum of |tau qd| over the joints in the last control sample (W).
    power: f64,
    last: Option<Step>,
    /// When the task was first fulfilled (s).
    fulfilled: Option<f64>,
    /// Moving bodies that carry shapes.
    bodies: Vec<usize>,
}

impl Session {
    /// Begins the episode of a set-up.
    ///
    /// # Errors
    /// A sentence: what is wrong with the set-up.
    pub fn open(setup: Setup) -> Result<Session, String> {
        let (config, player, knobs) = setup.resolve()?;
        let mut env = Env::new(config, 0).map_err(|error| sentence(&error))?;
        if let Player::Policy(policy) = &player
            && !policy.fits(&env)
        {
            return Err(format!("The policy {} does not fit what {} observes today.", policy.run, setup.task));
        }
        env.try_reset(Some(setup.seed)).map_err(|error| sentence(&error))?;
        let mut bodies: Vec<usize> = env.simulation().solids().iter().filter_map(|solid| solid.body).collect();
        bodies.sort_unstable();
        bodies.dedup();
        let mut session = Session {
            env,
            player,
            knobs,
            setup,
            hand: None,
            acting: false,
            time: 0.0,
            energy: 0.0,
            power: 0.0,
            last: None,
            fulfilled: None,
            bodies,
        };
        session.begin();
        Ok(session)
    }

    fn begin(&mut self) {
        self.acting = true;
        match &self.player {
            Player::Hold => self.env.wait(),
            Player::Script => self.env.begin(&self.env.expert_action()),
            Player::Policy(policy) => self.env.begin(&policy.act(&self.env)),
        }
    }

    /// Changes the space's numbers and the delay while the episode runs.
    ///
    /// # Errors
    /// A sentence: what is wrong with the set-up, or that it changes another setting too.
    pub fn tune(&mut self, setup: Setup) -> Result<(), String> {
        if (Setup { knobs: setup.knobs.clone(), delay: setup.delay, ..self.setup.clone() }) != setup {
            return Err("Only the space's numbers and the delay change while an episode runs.".into());
        }
        let (config, ..) = setup.resolve()?;
        self.env.set_stiffness(config.space.stiffness).map_err(|error| sentence(&error))?;
        self.env.set_torque_delay(setup.delay).map_err(|error| sentence(&error))?;
        self.setup = setup;
        Ok(())
    }

    /// Puts a hand on the arm, or takes it off.
    ///
    /// # Errors
    /// If there is no such body.
    pub fn hold(&mut self, hand: Option<Hand>) -> Result<(), String> {
        if let Some(Hand::Pull { body, .. }) = hand
            && !self.bodies.contains(&body)
        {
            return Err(format!("There is no body {body} to pull."));
        }
        self.hand = hand;
        Ok(())
    }

    /// Whether the episode has ended: it diverged, or has had all its actions. The player `hold` goes on beyond the
    /// last action.
    fn over(&self) -> bool {
        self.last.is_some_and(|step| step.terminated || step.truncated && !matches!(self.player, Player::Hold))
    }

    /// Runs so many control samples, fewer if the episode ends.
    pub fn run(&mut self, samples: u32) {
        for _ in 0..samples {
            if self.over() {
                return;
            }
            if !self.acting {
                self.begin();
            }
            let push = self.hand.map(|hand| self.push(hand));
            self.env.push(push);
            let dt = self.env.config().controller.dt();
            let mut power = 0.0;
            self.acting = self.env.advance(|sample: &Sample| {
                let qd = sample.simulation.joints().1;
                power = sample.tau.iter().zip(&qd).map(|(tau, qd)| (tau * qd).abs()).sum();
            });
            self.power = power;
            self.time += dt;
            if !self.acting {
                let step = self.env.end();
                self.energy += step.interval.energy.absolute;
                if step.success && self.fulfilled.is_none() {
                    self.fulfilled = Some(self.time);
                }
                self.last = Some(step);
            }
        }
    }

    /// The present force of the hand.
    fn push(&self, hand: Hand) -> Push {
        match hand {
            Hand::Pull { body, point, to } => {
                let point = Vector3::from(point);
                let stretch = Vector3::from(to) - self.place(body, &point);
                let force = stretch * PULL_STIFFNESS;
                Push { body, point, force: force * (STRONGEST_PULL / force.norm().max(STRONGEST_PULL)) }
            }
            Hand::Force(force) => {
                let body = self.tool_body();
                let pose = self.env.simulation().body_pose(body);
                let tool = self.tool().translation.vector;
                let point = pose.rotation.inverse() * (tool - pose.translation.vector);
                Push { body, point, force: force.into() }
            }
        }
    }

    /// Position of a point of a body, which is given in the body's frame (m, world).
    fn place(&self, body: usize, point: &Vector3) -> Vector3 {
        let pose = self.env.simulation().body_pose(body);
        pose.translation.vector + pose.rotation * point
    }

    fn tool(&self) -> Pose {
        let simulation = self.env.simulation();
        simulation.model().kinematics(&simulation.joints().0).tool
    }

    /// The body that carries the tool point.
    fn tool_body(&self) -> usize {
        self.env.simulation().tool()
    }

    /// The point that a ray from `origin` (m) along `direction` (world) meets first; null if that is no body that can be pulled.
    pub fn grab(&self, origin: [f64; 3], direction: [f64; 3]) -> Value {
        let simulation = self.env.simulation();
        let (origin, direction) = (Vector3::from(origin), Vector3::from(direction));
        let Some((geom, distance)) = simulation.surfaces().strike(&origin, &direction) else { return Value::Null };
        let Some(body) = simulation.solids()[geom].body else { return Value::Null };
        let (at, pose) = (origin + direction * distance, simulation.body_pose(body));
        let point = pose.rotation.inverse() * (at - pose.translation.vector);
        json!({"body": body, "point": point.as_slice(), "at": at.as_slice()})
    }

    /// What does not change during the episode.
    pub fn scene(&self) -> Value {
        let (env, simulation) = (&self.env, self.env.simulation());
        let solids: Vec<Value> = simulation
            .solids()
            .iter()
            .map(|solid| {
                let (kind, size) = solid.shape.kind_and_sizes();
                let body = solid.body.map(|body| self.bodies.iter().position(|&b| b == body));
                json!({"kind": kind, "size": size, "body": body, "pose": seven(&solid.pose), "color": solid.color})
            })
            .collect();
        let task = env.task().camera();
        let camera = |name: &str, camera: physics::camera::Camera| json!({"name": name, "eye": camera.eye, "target": camera.target, "fov": camera.field_of_view});
        json!({
            "setup": self.setup,
            "solids": solids,
            "bodies": self.bodies.len(),
            "cameras": [
                camera("Task", task),
                camera("Front", task.from_direction([1.0, 0.0, 0.35])),
                camera("Side", task.from_direction([0.0, -1.0, 0.35])),
                camera("Top", task.from_direction([0.001, 0.0, 1.0])),
            ],
            "leash": env.controller().space().goal.leash(),
            "dt": env.config().controller.dt(),
            "rate": env.config().controller.policy_hz,
            "knobs": self.knobs,
            "achievement": env.task().achievement(),
            "has_table": self.has_table(),
            "state": self.state(),
        })
    }

    fn has_table(&self) -> bool {
        let raised = Setup { table: 0.001, knobs: Default::default(), ..self.setup.clone() };
        raised.resolve().is_ok()
    }

    /// What changes during the episode, after the last control sample.
    pub fn state(&self) -> Value {
        let (env, simulation, controller) = (&self.env, self.env.simulation(), self.env.controller());
        let poses: Vec<f64> = self.bodies.iter().flat_map(|&body| seven(&simulation.body_pose(body))).collect();
        let force: Vector3 = simulation.contact().sustained.fixed_rows::<3>(0).into();
        let (stiffness, engagement, n) = (controller.stiffness(), controller.engagement(), controller.contact_axis());
        let acting: Vec<f64> = (0..3).map(|i| stiffness[i] * (1.0 - engagement * n[i] * n[i])).collect();
        let pull = self.hand.map(|hand| {
            let push = self.push(hand);
            json!({"at": self.place(push.body, &push.point).as_slice(), "force": push.force.as_slice()})
        });
        let decals: Vec<Value> = env
            .task()
            .decals()
            .iter()
            .map(|decal| json!({"centre": decal.centre, "radius": decal.radius, "color": decal.color}))
            .collect();
        json!({
            "time": self.time,
            "poses": poses,
            "tool": self.tool().translation.vector.as_slice(),
            "goal": seven(controller.goal()),
            "force": force.as_slice(),
            "stiffness": acting,
            "rotational_stiffness": stiffness.as_slice()[3..],
            "feedforward": controller.feedforward().as_slice(),
            "error": controller.error().as_slice(),
            "energy": self.energy,
            "power": self.power,
            "reward": self.last.map_or(0.0, |step| step.reward),
            "success": self.last.is_some_and(|step| step.success),
            "fulfilled": self.fulfilled,
            "over": self.over(),
            "diverged": self.last.is_some_and(|step| step.diverged),
            "over_limit": self.last.is_some_and(|step| step.over_limit),
            "pull": pull,
            "decals": decals,
        })
    }
}

fn seven(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, pose.rotation);
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}
