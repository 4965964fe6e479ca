#include "base/format_instances.h"

MBV_FORMAT_INSTANCES(template)
