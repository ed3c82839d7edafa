"""Random actions in a task of gymnasium: TASK STEPS."""

import sys

import gymnasium

task, steps = sys.argv[1], int(sys.argv[2])
env = gymnasium.make(task)
env.reset(seed=0)
env.action_space.seed(0)
actions = [env.action_space.sample() for _ in range(1024)]
for step in range(steps):
    _, _, terminated, truncated, _ = env.step(actions[step % len(actions)])
    if terminated or truncated:
        env.reset()
