#pragma once

#include <string>

#include <gtest/gtest.h>

namespace visual_localization::test {

/// "accepted" if no exception of this class refuses the action.
template <class Error, class Action>
std::string refusalOf(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  return "accepted";
}

}  // namespace visual_localization::test
