// Products for processors with AVX-512; CMakeLists.txt compiles this file for them.

// The linker keeps one copy of an inline function for the whole program, and it must not be this
// file's: so Eigen's functions have other names here, and none of ours is called.
#define Eigen EigenV4

#define O2V_ISA v4
#define O2V_REGISTER 64  // [bytes]
#include "nn/product_loops.h"
