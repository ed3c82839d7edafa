#pragma once
// A compiled model as JSON in the form of the reference dumps, and the comparison of two dumps.

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace o2v {

/// Writes the fields that a reference dump lists. Integers are JSON integers and mjtNums JSON
/// floats, which is how the comparison tells them apart.
class ModelDump {
 public:
  using Json = nlohmann::ordered_json;

  static Json Of(const mjModel& m) { return ModelDump(m).All(); }

 private:
  explicit ModelDump(const mjModel& m) : m_(m) {}

  std::string Name(int type, int id) const {
    const char* name = mj_id2name(&m_, type, id);
    return name ? name : "";
  }
  static Json Numbers(const mjtNum* x, int n) { return std::vector<double>(x, x + n); }

  // The objects 0..n-1, each written by f.
  template <typename F>
  static Json List(int n, F f) {
    Json list = Json::array();
    for (int i = 0; i < n; ++i) list.push_back(f(i));
    return list;
  }

  Json All() const {
    return {{"sizes", Sizes()},
            {"option", Option()},
            {"qpos0", Numbers(m_.qpos0, m_.nq)},
            {"qpos_spring", Numbers(m_.qpos_spring, m_.nq)},
            {"bodies", List(m_.nbody, [this](int i) { return Body(i); })},
            {"joints", List(m_.njnt, [this](int i) { return Joint(i); })},
            {"geoms", List(m_.ngeom, [this](int i) { return Geom(i); })},
            {"sites", List(m_.nsite, [this](int i) { return Site(i); })},
            {"tendons", List(m_.ntendon, [this](int i) { return Tendon(i); })},
            {"actuators", List(m_.nu, [this](int i) { return Actuator(i); })},
            {"sensors", List(m_.nsensor, [this](int i) { return Sensor(i); })},
            // No reference model has one: the sizes say so.
            {"equalities", Json::array()},
            {"excludes_body_pairs", Json::array()}};
  }

  Json Sizes() const {
    return {{"nq", m_.nq},           {"nv", m_.nv},       {"nu", m_.nu},
            {"na", m_.na},           {"nbody", m_.nbody}, {"njnt", m_.njnt},
            {"ngeom", m_.ngeom},     {"nsite", m_.nsite}, {"ntendon", m_.ntendon},
            {"nsensor", m_.nsensor}, {"neq", m_.neq},     {"nexclude", m_.nexclude},
            {"npair", m_.npair}};
  }

  Json Option() const {
    const mjOption& o = m_.opt;
    static constexpr const char* kIntegrators[] = {"Euler", "RK4", "implicit"};
    static constexpr const char* kCones[] = {"pyramidal", "elliptic"};
    static constexpr const char* kSolvers[] = {"PGS", "CG", "Newton"};
    return {{"timestep", o.timestep},
            {"integrator", kIntegrators[o.integrator]},
            {"cone", kCones[o.cone]},
            {"solver", kSolvers[o.solver]},
            {"iterations", o.iterations},
            {"tolerance", o.tolerance},
            {"noslip_iterations", o.noslip_iterations},
            {"impratio", o.impratio},
            {"density", o.density},
            {"viscosity", o.viscosity},
            {"disableflags", o.disableflags},
            {"enableflags", o.enableflags},
            {"collision", o.collision},
            {"wind", Numbers(o.wind, 3)},
            {"gravity", Numbers(o.gravity, 3)}};
  }

  Json Body(int i) const {
    return {{"name", Name(mjOBJ_BODY, i)},
            {"parent", m_.body_parentid[i]},
            {"mocap", m_.body_mocapid[i]},
            {"pos", Numbers(m_.body_pos + 3 * i, 3)},
            {"quat", Numbers(m_.body_quat + 4 * i, 4)},
            {"ipos", Numbers(m_.body_ipos + 3 * i, 3)},
            {"iquat", Numbers(m_.body_iquat + 4 * i, 4)},
            {"mass", m_.body_mass[i]},
            {"inertia", Numbers(m_.body_inertia + 3 * i, 3)}};
  }

  Json Joint(int i) const {
    static constexpr const char* kTypes[] = {"free", "ball", "slide", "hinge"};
    const int dof = m_.jnt_dofadr[i];
    return {{"name", Name(mjOBJ_JOINT, i)},
            {"type", kTypes[m_.jnt_type[i]]},
            {"body", Name(mjOBJ_BODY, m_.jnt_bodyid[i])},
            {"body_id", m_.jnt_bodyid[i]},
            {"limited", int{m_.jnt_limited[i]}},
            {"margin", m_.jnt_margin[i]},
            {"stiffness", m_.jnt_stiffness[i]},
            {"damping", m_.dof_damping[dof]},
            {"armature", m_.dof_armature[dof]},
            {"frictionloss", m_.dof_frictionloss[dof]},
            {"pos", Numbers(m_.jnt_pos + 3 * i, 3)},
            {"axis", Numbers(m_.jnt_axis + 3 * i, 3)},
            {"range_rad_or_m", Numbers(m_.jnt_range + 2 * i, 2)},
            {"solreflimit", Numbers(m_.jnt_solref + mjNREF * i, mjNREF)},
            {"solimplimit", Numbers(m_.jnt_solimp + mjNIMP * i, mjNIMP)}};
  }

  Json Geom(int i) const {
    static constexpr const char* kTypes[] = {"plane",     "hfield",   "sphere", "capsule",
                                             "ellipsoid", "cylinder", "box",    "mesh"};
    return {{"name", Name(mjOBJ_GEOM, i)},
            {"type", kTypes[m_.geom_type[i]]},
            {"body", Name(mjOBJ_BODY, m_.geom_bodyid[i])},
            {"body_id", m_.geom_bodyid[i]},
            {"contype", m_.geom_contype[i]},
            {"conaffinity", m_.geom_conaffinity[i]},
            {"condim", m_.geom_condim[i]},
            {"group", m_.geom_group[i]},
            {"priority", m_.geom_priority[i]},
            {"solmix", m_.geom_solmix[i]},
            {"margin", m_.geom_margin[i]},
            {"gap", m_.geom_gap[i]},
            {"size", Numbers(m_.geom_size + 3 * i, 3)},
            {"pos", Numbers(m_.geom_pos + 3 * i, 3)},
            {"quat", Numbers(m_.geom_quat + 4 * i, 4)},
            {"friction", Numbers(m_.geom_friction + 3 * i, 3)},
            {"solref", Numbers(m_.geom_solref + mjNREF * i, mjNREF)},
            {"solimp", Numbers(m_.geom_solimp + mjNIMP * i, mjNIMP)},
            {"fluid", Numbers(m_.geom_fluid + mjNFLUID * i, mjNFLUID)}};
  }

  Json Site(int i) const {
    return {{"name", Name(mjOBJ_SITE, i)},
            {"body", Name(mjOBJ_BODY, m_.site_bodyid[i])},
            {"body_id", m_.site_bodyid[i]},
            {"pos", Numbers(m_.site_pos + 3 * i, 3)},
            {"quat", Numbers(m_.site_quat + 4 * i, 4)},
            {"size", Numbers(m_.site_size + 3 * i, 3)}};
  }

  Json Tendon(int i) const {
    const auto wrap = [&](int k) -> Json {
      const int w = m_.tendon_adr[i] + k;
      return {{"type", m_.wrap_type[w]},
              {"obj", Name(mjOBJ_JOINT, m_.wrap_objid[w])},
              {"prm", m_.wrap_prm[w]}};
    };
    return {
        {"name", Name(mjOBJ_TENDON, i)},         {"limited", int{m_.tendon_limited[i]}},
        {"stiffness", m_.tendon_stiffness[i]},   {"damping", m_.tendon_damping[i]},
        {"wraps", List(m_.tendon_num[i], wrap)}, {"range", Numbers(m_.tendon_range + 2 * i, 2)}};
  }

  Json Actuator(int i) const {
    const bool joint = m_.actuator_trntype[i] == mjTRN_JOINT;
    return {{"name", Name(mjOBJ_ACTUATOR, i)},
            {"transmission", joint ? "joint" : "tendon"},
            {"target", Name(joint ? mjOBJ_JOINT : mjOBJ_TENDON, m_.actuator_trnid[2 * i])},
            {"dyntype", m_.actuator_dyntype[i]},
            {"gaintype", m_.actuator_gaintype[i]},
            {"biastype", m_.actuator_biastype[i]},
            {"ctrllimited", int{m_.actuator_ctrllimited[i]}},
            {"forcelimited", int{m_.actuator_forcelimited[i]}},
            {"ctrlrange", Numbers(m_.actuator_ctrlrange + 2 * i, 2)},
            {"forcerange", Numbers(m_.actuator_forcerange + 2 * i, 2)},
            {"gear", Numbers(m_.actuator_gear + 6 * i, 6)},
            {"gainprm3", Numbers(m_.actuator_gainprm + mjNGAIN * i, 3)},
            {"biasprm3", Numbers(m_.actuator_biasprm + mjNBIAS * i, 3)}};
  }

  Json Sensor(int i) const {
    return {{"name", Name(mjOBJ_SENSOR, i)},
            {"type", m_.sensor_type[i]},
            {"objtype", mju_type2Str(m_.sensor_objtype[i])},
            {"obj", Name(m_.sensor_objtype[i], m_.sensor_objid[i])},
            {"dim", m_.sensor_dim[i]},
            {"adr", m_.sensor_adr[i]}};
  }

  const mjModel& m_;
};

/// The worst field of a comparison.
struct FieldDeviation {
  double value = 0;   // |a - b| / (1e-14 + 1e-9 |b|), so that 1 is the bound; infinite if not equal
  std::string field;  // "/bodies/3/mass"
};

/// Largest deviation of a dump `a` of ours from a reference b: numbers as above, integers and
/// strings exactly; b's empty names and the ranges of its unlimited joints are free. Source:
/// spec E.5 (the bound is on |a - b|).
inline FieldDeviation CompareDumps(const ModelDump::Json& a, const ModelDump::Json& b,
                                   const std::string& field = "") {
  constexpr double kUnequal = std::numeric_limits<double>::infinity();
  FieldDeviation worst;
  const auto take = [&](const FieldDeviation& d) {
    if (d.value > worst.value) worst = d;
  };
  if (b.is_object()) {
    for (const auto& [key, value] : b.items()) {
      const bool free_range = key == "range_rad_or_m" && b.at("limited") == 0;
      if (!a.contains(key)) {
        take({kUnequal, field + "/" + key});
      } else if (!free_range) {
        take(CompareDumps(a.at(key), value, field + "/" + key));
      }
    }
  } else if (b.is_array()) {
    if (a.size() != b.size()) return {kUnequal, field};
    for (std::size_t i = 0; i < b.size(); ++i) {
      take(CompareDumps(a[i], b[i], field + "/" + std::to_string(i)));
    }
  } else if (b.is_string()) {
    if (b != "" && a != b) take({kUnequal, field});
  } else if (a.is_number_float()) {
    const double x = a, y = b;
    const double d = std::abs(x - y) / (1e-14 + 1e-9 * std::abs(y));
    take({std::isfinite(d) ? d : kUnequal, field});
  } else if (a != b) {
    take({kUnequal, field});
  }
  return worst;
}

}  // namespace o2v
