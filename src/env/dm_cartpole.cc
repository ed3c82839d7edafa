#include "env/dm_env.h"

namespace o2v {
namespace {

/// Keep a pole upright on a cart.
/// obs (5): cart x [m], cos and sin of the pole's angle, qvel [m/s, rad/s]. action (1): control in
/// [-1, 1]. limit: 1000 steps of 0.01 s.
/// initial state: cart U(-0.1, 0.1), pole U(-0.034, 0.034), qvel 0.01 N.
/// Source: spec E.3.
class Cartpole : public DmEnv {
 protected:
  Cartpole(const char* id, int time_limit)
      : DmEnv({id, "dm_cartpole", /*frame_skip=*/1, /*S=*/5}, time_limit) {}

  double Cart() const { return qpos()[0]; }
  double Cos() const { return Xmat(pole_, 2, 2); }

 private:
  void DrawStart(Rng& rng, std::span<double> qpos, std::span<double> qvel) override {
    AddUniform(rng, 0.1, qpos.first(1));
    AddUniform(rng, 0.034, qpos.last(1));
    AddNormal(rng, 0.01, qvel);
  }

  void Observe(ObservationWriter& obs) const override {
    obs.Add(Cart());
    obs.Add(Cos());
    obs.Add(Xmat(pole_, 0, 2));
    obs.Add(qvel());
  }

  int pole_ = BodyId("pole_1");
};

/// dm-cartpole-balance. reward: (cos + 1) / 2, times three factors that fall from 1 to at least
/// 4/5, 1/2, 1/2 with the control, the pole's velocity [rad/s] and the cart's distance [m].
class CartpoleBalance final : public Cartpole {
 public:
  explicit CartpoleBalance(int time_limit) : Cartpole("dm-cartpole-balance", time_limit) {}

 private:
  double Reward(std::span<const double> a) const override {
    const double upright = (Cos() + 1) / 2;
    const double small_control = (4 + Tolerance(a[0], {0, 0}, 1, Sigmoid::kQuadratic, 0)) / 5;
    const double slow = (1 + Tolerance(qvel()[1], {0, 0}, 5)) / 2;
    const double centred = (1 + Tolerance(Cart(), {0, 0}, 2)) / 2;
    return upright * small_control * slow * centred;
  }
};

/// dm-cartpole-balance_sparse. reward: 1 while |x| <= 0.25 m and cos >= 0.995, else 0.
class CartpoleBalanceSparse final : public Cartpole {
 public:
  explicit CartpoleBalanceSparse(int time_limit)
      : Cartpole("dm-cartpole-balance_sparse", time_limit) {}

 private:
  double Reward(std::span<const double>) const override {
    return Tolerance(Cart(), {-0.25, 0.25}) * Tolerance(Cos(), {0.995, 1});
  }
};

}  // namespace

std::unique_ptr<Env> MakeDmCartpoleBalance(const EnvOptions&, int time_limit) {
  return std::make_unique<CartpoleBalance>(time_limit);
}

std::unique_ptr<Env> MakeDmCartpoleBalanceSparse(const EnvOptions&, int time_limit) {
  return std::make_unique<CartpoleBalanceSparse>(time_limit);
}

}  // namespace o2v
