#pragma once
// Elementwise functions. Each backward takes the output, so that no input is kept. Columns of the
// arguments lie together (whole matrices or blocks of whole columns); else they throw Error.

#include "base/types.h"

namespace o2v {

/// Nonlinearity g of a hidden layer.
enum class Activation { kTanh, kRelu };

/// y := g(y + b), b (n) added to every column of y (n, B), in one pass.
void BiasActivate(Activation g, const Mat& b, MatRef y);
/// y := tanh(y).
void Tanh(MatRef y);
/// dy := dy * g'(.), y = g(.) as Forward left it; both (n, B). At ReLU's kink the derivative is 0.
void ActivationBackward(Activation g, const ConstMatRef& y, MatRef dy);

/// y := softplus(y), softplus(x) = ln(1 + e^x), linear above x = 20 (spec 2.1).
void Softplus(MatRef y);
/// dy := dy * sigmoid(x), from y = softplus(x): sigmoid(x) = 1 - e^{-y}.
void SoftplusBackward(const ConstMatRef& y, MatRef dy);
/// y := sigmoid(y).
void Sigmoid(MatRef y);
/// dy := dy * y (1 - y).
void SigmoidBackward(const ConstMatRef& y, MatRef dy);

}  // namespace o2v
