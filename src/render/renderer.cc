#include "render/renderer.h"

#include <dlfcn.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

#include "base/check.h"
#include "env/mujoco_env.h"

namespace o2v {
namespace {

constexpr int kSmallest = 64, kLargest = 4096;  // [pixels]; ours, and within all of OSMesa's
constexpr int kGeoms = 2000;                    // of a scene; our models have fewer than 50

// ---- OSMesa, by its documented interface

constexpr char kLibrary[] = "libOSMesa.so.8";
constexpr unsigned kRgba = 0x1908, kUnsignedByte = 0x1401;  // GL_RGBA, GL_UNSIGNED_BYTE

/// A context of OpenGL that draws into memory, current while it lives.
class OsMesa {
 public:
  OsMesa(int width, int height) : pixels_(4 * std::size_t(width) * std::size_t(height)) {
    // Global, as MuJoCo looks for the library among the names of the process; never closed, as
    // it cannot be loaded twice.
    void* const library = ::dlopen(kLibrary, RTLD_NOW | RTLD_GLOBAL);
    if (!library) {
      throw ConfigError(
          Concat(kLibrary, " is missing, which draws; `make deps FILM=1` installs it"));
    }
    const auto create =
        Find<void* (*)(unsigned, int, int, int, void*)>(library, "OSMesaCreateContextExt");
    const auto make_current =
        Find<unsigned char (*)(void*, void*, unsigned, int, int)>(library, "OSMesaMakeCurrent");
    destroy_ = Find<void (*)(void*)>(library, "OSMesaDestroyContext");
    context_ = create(kRgba, /*depth=*/24, /*stencil=*/8, /*accumulation=*/0, nullptr);
    if (!context_ || !make_current(context_, pixels_.data(), kUnsignedByte, width, height)) {
      throw Error(Concat(kLibrary, ": no context of ", width, " x ", height, " pixels"));
    }
  }
  ~OsMesa() { destroy_(context_); }
  OsMesa(const OsMesa&) = delete;
  OsMesa& operator=(const OsMesa&) = delete;

 private:
  template <typename Function>
  static Function Find(void* library, const char* name) {
    void* const found = ::dlsym(library, name);
    if (!found) throw ConfigError(Concat(kLibrary, ": has no ", name));
    return reinterpret_cast<Function>(found);
  }

  std::vector<unsigned char> pixels_;
  void* context_ = nullptr;
  void (*destroy_)(void*) = nullptr;
};

const MujocoEnv& Simulated(const Env& env) {
  const auto* simulated = dynamic_cast<const MujocoEnv*>(&env);
  if (!simulated) throw ConfigError(env.Spec().id + ": not simulated by MuJoCo, cannot be drawn");
  return *simulated;
}

void RequireSize(int width, int height) {
  for (const int side : {width, height}) {
    if (side < kSmallest || side > kLargest || side % 2 != 0) {
      throw ConfigError(Concat("size ", width, "x", height, ": sides are even numbers in [",
                               kSmallest, ", ", kLargest, "]"));
    }
  }
}

/// Floors have no end for the simulator, but are drawn as large as they are in the model. Wide ones
/// go with the camera, by whole metres: the pattern of their tiles stays where it is.
void MoveFloor(mjvScene& scene) {
  constexpr float kWide = 10;  // [m]
  for (int i = 0; i < scene.ngeom; ++i) {
    mjvGeom& geom = scene.geoms[i];
    if (geom.type != mjGEOM_PLANE || geom.size[0] < kWide) continue;
    for (int axis : {0, 1}) geom.pos[axis] += std::round(scene.camera[0].pos[axis]);
  }
}

void Fill(const mjrRect& where, int o) {
  const auto [r, g, b] = OptionColor(o);
  mjr_rectangle(where, float(r) / 255, float(g) / 255, float(b) / 255, 1);
}

}  // namespace

std::array<int, 3> OptionColor(int o) {
  constexpr std::array<int, 3> kColors[] = {{230, 159, 0},   {86, 180, 233}, {0, 158, 115},
                                            {204, 121, 167}, {240, 228, 66}, {0, 114, 178},
                                            {213, 94, 0}};
  return kColors[std::size_t(o) % std::size(kColors)];
}

Bands BandsOf(int height) { return {std::max(height / 20, 18), std::max(height / 40, 4)}; }

struct Renderer::Parts {
  Parts(const MujocoEnv& simulated, int w, int h) : env(simulated), width(w), height(h) {}
  ~Parts() {
    mjr_freeContext(&context);
    mjv_freeScene(&scene);
    mj_deleteData(data);
  }

  const MujocoEnv& env;
  const int width, height;
  OsMesa memory{width, height};
  mjData* data = nullptr;  // ours: positions follow the task's
  mjvScene scene;
  mjvCamera camera;
  mjvOption visible;
  mjrContext context;
};

Renderer::Renderer(const Env& env, int width, int height) {
  const MujocoEnv& simulated = Simulated(env);
  RequireSize(width, height);
  parts_ = std::make_unique<Parts>(simulated, width, height);
  Parts& p = *parts_;
  const mjModel& model = simulated.model();
  p.data = mj_makeData(&model);
  mjv_defaultScene(&p.scene);
  mjv_makeScene(&model, &p.scene, kGeoms);
  p.scene.flags[mjRND_REFLECTION] = 0;  // it would double the time
  mjv_defaultOption(&p.visible);
  mjv_defaultCamera(&p.camera);
  if (model.ncam > 0) {  // the model's own, which follows the body
    p.camera.type = mjCAMERA_FIXED;
    p.camera.fixedcamid = 0;
  } else {
    mjv_defaultFreeCamera(&model, &p.camera);
  }
  mjr_defaultContext(&p.context);
  // Sizes of buffers are the model's; those of a copy, as the task's stays as it is.
  const std::unique_ptr<mjModel, void (*)(mjModel*)> sized(mj_copyModel(nullptr, &model),
                                                           mj_deleteModel);
  sized->vis.global.offwidth = width;
  sized->vis.global.offheight = height;
  sized->vis.quality.offsamples = 4;  // ours, as are 2048: good enough to see, twice as fast
  sized->vis.quality.shadowsize = 2048;
  mjr_makeContext(sized.get(), &p.context, height >= 720 ? mjFONTSCALE_150 : mjFONTSCALE_100);
  mjr_setBuffer(mjFB_OFFSCREEN, &p.context);
}

Renderer::~Renderer() = default;

double Renderer::StepSeconds() const { return parts_->env.dt(); }

void Renderer::Draw(const Captions& captions, Image& image) {
  Parts& p = *parts_;
  const mjModel& model = p.env.model();
  std::copy(p.env.qpos().begin(), p.env.qpos().end(), p.data->qpos);
  mj_kinematics(&model, p.data);
  mj_comPos(&model, p.data);  // which tracking cameras follow
  mj_camlight(&model, p.data);
  mjv_updateScene(&model, p.data, &p.visible, nullptr, &p.camera, mjCAT_ALL, &p.scene);

  MoveFloor(p.scene);

  const auto [bar, time_line] = BandsOf(p.height);
  const mjrRect picture = {0, bar + time_line, p.width, p.height - bar - time_line};
  mjr_render(picture, &p.scene, &p.context);
  mjr_overlay(mjFONT_NORMAL, mjGRID_TOPLEFT, picture, captions.names.c_str(),
              captions.values.c_str(), &p.context);
  const mjrRect line = {0, 0, p.width, time_line}, above = {0, time_line, p.width, bar};
  for (const mjrRect& band : {line, above}) mjr_rectangle(band, 0.15f, 0.15f, 0.15f, 1);
  const int n = int(captions.options.size()), length = std::max({captions.time_limit, n, 1});
  const auto x = [&](int step) { return int(std::int64_t{step} * p.width / length); };
  for (int begin = 0, end; begin < n; begin = end) {  // a rectangle an execution of an option
    const int o = captions.options[std::size_t(begin)];
    for (end = begin + 1; end < n && captions.options[std::size_t(end)] == o;) ++end;
    Fill({x(begin), 0, std::max(x(end) - x(begin), 1), time_line}, o);
  }
  if (n > 0) {
    const int o = captions.options.back();
    Fill(above, o);
    mjr_label(above, mjFONT_NORMAL, Concat("option ", o).c_str(), 0, 0, 0, 0, 0, 0, 0, &p.context);
  }

  image.width = p.width;
  image.height = p.height;
  image.rgb.resize(3 * std::size_t(p.width) * std::size_t(p.height));
  mjr_readPixels(image.rgb.data(), nullptr, {0, 0, p.width, p.height}, &p.context);
  const auto row = [&](int y) { return image.rgb.begin() + std::ptrdiff_t{3} * p.width * y; };
  for (int y = 0; y < p.height / 2; ++y) {  // OpenGL's rows begin at the bottom
    std::swap_ranges(row(y), row(y + 1), row(p.height - 1 - y));
  }
}

}  // namespace o2v
