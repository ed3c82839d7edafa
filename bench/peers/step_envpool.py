"""Random actions in ENVS tasks of EnvPool on one thread: TASK STEPS ENVS."""

import sys

import envpool
import numpy as np

task, steps, envs = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
pool = envpool.make(task, env_type="gymnasium", num_envs=envs, num_threads=1, seed=0)
pool.reset()
low, high = pool.action_space.low, pool.action_space.high
actions = np.random.default_rng(0).uniform(low, high, (64, envs, len(low)))
for step in range(steps // envs):
    pool.step(actions[step % len(actions)])
