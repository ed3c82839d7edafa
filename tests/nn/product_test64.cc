// The same in double precision, of which a register holds half as many.

#include "nn/product_test.cc"
