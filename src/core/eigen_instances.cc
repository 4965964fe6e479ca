#include "core/eigen_instances.h"

MBV_EIGEN_INSTANCES(template)
