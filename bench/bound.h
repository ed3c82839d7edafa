#pragma once
// What a step of training cannot but cost: work that no implementation avoids, at the best rate
// that a bare product or memory pass reaches here. A product's is Eigen's or that of our own loops
// (nn/product.h), whichever is faster; of our layers nothing else is timed.

#include <string>
#include <vector>

#include "base/types.h"
#include "run/config.h"

namespace o2v::bench {

/// A matrix product C (m, n) += A (m, k) B (k, n), `per_step` times an environment step.
struct Product {
  std::string what;
  Index m, k, n;
  double per_step;

  double MflopPerStep() const { return 2e-6 * double(m) * double(k) * double(n) * per_step; }
};

/// The products of inference, values and update that cannot be skipped, after all that is shared by
/// the batch (keys, values, tables of the K embeddings, columns of one-hot inputs) has been taken
/// out of it. First layers need no input gradient; the action stage of `paper` needs no option
/// policy, that of `released` its forward pass. A sample passes through the networks of its own
/// option; the options are taken to be executed equally often. What acting has computed with the
/// weights that the update starts from (OC, IOPG) is not computed again. Throws Error for a method
/// without a list.
std::vector<Product> Products(const RunConfig& config, int S, int A);

/// Entries that Adam visits an environment step. episode_length [steps] is the mean one of a method
/// that learns once an episode.
double AdamEntriesPerStep(const RunConfig& config, int S, int A, double episode_length);

/// CPU seconds of one bare product of these shapes on data that stays in cache, Eigen's or ours:
/// that of the faster. Takes some milliseconds.
double ProductSeconds(Index m, Index k, Index n);
/// The same of all these products, an environment step; each shape is measured once a call.
double ProductSecondsPerStep(const std::vector<Product>& products);
/// CPU seconds an entry of clipping and Adam as memory passes over flat arrays.
double AdamSecondsPerEntry();

}  // namespace o2v::bench
