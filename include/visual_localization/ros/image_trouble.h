#pragma once

#include <string>

#include "visual_localization/localizer/estimate.h"

namespace visual_localization {

/// What is wrong with the image that led to `estimate`, in a line that people understand; empty when nothing seems to
/// be. An image that is recognised is all right, whatever it is like.
std::string imageTrouble(const Estimate& estimate);

}  // namespace visual_localization
