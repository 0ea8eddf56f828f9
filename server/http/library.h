#pragma once

#include <httplib.h>

// A macro of resolv.h, which cpp-httplib includes; Eigen has parameters of that name.
#undef _res
