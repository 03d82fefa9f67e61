#include "tether/qp/active_set_kernel.h"
