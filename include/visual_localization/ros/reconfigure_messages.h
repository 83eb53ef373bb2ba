#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>

#include "visual_localization/parameters/parameters.h"

namespace visual_localization {

/// What tools like rqt_reconfigure need to know of every parameter that can change while the node runs: type, range,
/// meaning and present value as default. Names are the full ones, "dpso/particles", as on the parameter server; the
/// group "dpso/" holds all that begin so.
dynamic_reconfigure::ConfigDescription toDescription(const parameters::Declaration& declare);

/// The present values of the same parameters.
dynamic_reconfigure::Config toConfig(const parameters::Declaration& declare);

/// The values that a message names. Throws ParameterError, with name and value, for one that is read at the start only.
ParameterValues toValues(const dynamic_reconfigure::Config& config, const parameters::Declaration& declare);

}  // namespace visual_localization
