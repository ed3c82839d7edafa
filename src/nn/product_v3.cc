// Products for every processor that runs the program.

#define O2V_ISA v3
#define O2V_REGISTER 32  // [bytes]
#include "nn/product_loops.h"
