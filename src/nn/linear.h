#pragma once
// Affine map.

#include <string>
#include <vector>

#include "nn/param.h"

namespace o2v {

/// y = W x + b.
struct Linear {
  Param W;  // (n_out, n_in)
  Param b;  // (n_out, 1)

  Linear() = default;
  /// Names `name`.W and `name`.b; all zero.
  Linear(const std::string& name, Index n_in, Index n_out)
      : W(name + ".W", n_out, n_in), b(name + ".b", n_out, 1) {}

  /// x (n_in, B) -> y (n_out, B).
  void Forward(const ConstMatRef& x, MatRef y) const;
  /// y = W x only, for a nonlinearity that adds b in its own pass.
  void Multiply(const ConstMatRef& x, MatRef y) const;

  /// x as given to Forward, dy = dL/dy (n_out, B). Adds to W.grad and b.grad.
  void AddGrad(const ConstMatRef& x, const ConstMatRef& dy);
  /// dy (n_out, B) -> dx = dL/dx (n_in, B).
  void BackwardInput(const ConstMatRef& dy, MatRef dx) const;

  std::vector<Param*> Params() { return {&W, &b}; }

 private:
  void CheckInput(const ConstMatRef& x) const;
};

}  // namespace o2v
