#pragma once

#include <httplib.h>

// cpp-httplib includes resolv.h, which defines this macro; Eigen has parameters with the same name.
#undef _res
