// SPDX-License-Identifier: Apache-2.0
#include "lodselect/planner.h"
