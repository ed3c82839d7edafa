#include <dlfcn.h>
#include <mujoco/mujoco.h>

#include <filesystem>

#include "base/check.h"
#include "base/files.h"
#include "base/sha256.h"
#include "env/env.h"

namespace o2v {
namespace {

/// The file that a function of the simulator was loaded from.
std::string FindLibrary() {
  Dl_info info;
  Check(::dladdr(reinterpret_cast<const void*>(&mj_versionString), &info) != 0,
        "the file of libmujoco is not known");
  return std::filesystem::canonical(info.dli_fname);
}

}  // namespace

std::string PhysicsVersion() { return mj_versionString(); }

const PhysicsLibrary& LoadedPhysics() {
  static const PhysicsLibrary library = [] {
    const std::string file = FindLibrary();
    return PhysicsLibrary{file, Sha256(ReadFile(file))};
  }();
  return library;
}

}  // namespace o2v
