#include "../src/open_gripper.cpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>

using Tested = open_gripper_action::OpenGripper;

TEST(open_gripper_action, EndsSoonAfterAStop)
{
  Tested action;
  std::future<bool> result = std::async(std::launch::async, [&action] { return action.onRun(); });
  action.stopAction();
  EXPECT_EQ(result.wait_for(std::chrono::seconds(5)), std::future_status::ready);
}

TEST(open_gripper_action, HoldsWhileItIsPausedAndGoesOnAfterwards)
{
  Tested action;
  action.onPause();
  std::future<bool> result = std::async(std::launch::async, [&action] { return action.onRun(); });
  EXPECT_EQ(result.wait_for(std::chrono::seconds(2)), std::future_status::timeout);
  action.onResume();
  EXPECT_EQ(result.wait_for(std::chrono::seconds(30)), std::future_status::ready);
}

TEST(open_gripper_action, CanBeStoppedWhileItIsPaused)
{
  Tested action;
  action.onPause();
  std::future<bool> result = std::async(std::launch::async, [&action] { return action.onRun(); });
  action.stopAction();
  EXPECT_EQ(result.wait_for(std::chrono::seconds(5)), std::future_status::ready);
}
