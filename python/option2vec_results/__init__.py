"""Records, runs and policies of option2vec, with nothing but numpy.

    columns = load_records("results")           # one row a point of a learning curve
    run = load_run("runs/a")                    # what `option2vec train` left in a folder
    policy = load_policy("results/policies/HalfCheetah-v2-released.safetensors")
    o, a = act(policy, policy.normalise(observation), o_prev, init, numpy.random.default_rng(0))
"""

from option2vec_results.policy import Policy, act, forward, load_policy
from option2vec_results.records import DamagedFile, load_records
from option2vec_results.run import RunFolder, load_run

__all__ = ["DamagedFile", "Policy", "RunFolder", "act", "forward", "load_policy", "load_records",
           "load_run"]
