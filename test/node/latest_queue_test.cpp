#include <atomic>
#include <thread>

#include <gtest/gtest.h>

#include "node/image_worker.h"

namespace visual_localization {
namespace {

TEST(LatestQueue, TheNewestReplacesWhatNobodyTook) {
  LatestQueue<int> queue;
  queue.push(1);
  queue.push(2);
  queue.push(3);
  EXPECT_EQ(queue.pop(), 3);
  EXPECT_EQ(queue.dropped(), 2U);
}

TEST(LatestQueue, WhatWasTakenDoesNotCountAsDropped) {
  LatestQueue<int> queue;
  queue.push(1);
  EXPECT_EQ(queue.pop(), 1);
  queue.push(2);
  EXPECT_EQ(queue.pop(), 2);
  EXPECT_EQ(queue.dropped(), 0U);
}

TEST(LatestQueue, ClosingEndsAWaitAndForgetsWhatWasInIt) {
  LatestQueue<int> queue;
  std::atomic<bool> got_nothing{false};
  std::thread consumer([&] { got_nothing = !queue.pop().has_value(); });
  queue.close();
  consumer.join();
  EXPECT_TRUE(got_nothing);
  queue.push(1);
  EXPECT_FALSE(queue.pop().has_value());
}

TEST(LatestQueue, EveryItemIsTakenOrDropped) {
  LatestQueue<int> queue;
  constexpr std::uint64_t kItems = 20000;
  std::uint64_t taken = 0;
  int last = -1;
  std::thread consumer([&] {
    while (const auto item = queue.pop()) {
      EXPECT_GT(*item, last);  // never an older one after a newer one
      last = *item;
      ++taken;
      if (last + 1 == static_cast<int>(kItems)) break;
    }
  });
  for (std::uint64_t i = 0; i < kItems; ++i) queue.push(static_cast<int>(i));
  consumer.join();
  EXPECT_EQ(taken + queue.dropped(), kItems);
}

}  // namespace
}  // namespace visual_localization
