#include "../src/move_t_c_p.cpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>

using Tested = move_t_c_p_action::MoveTCP;

TEST(move_t_c_p_action, EndsSoonAfterAStop)
{
  Tested action;
  std::future<bool> result = std::async(std::launch::async, [&action] { return action.onRun(); });
  action.stopAction();
  EXPECT_EQ(result.wait_for(std::chrono::seconds(5)), std::future_status::ready);
}

TEST(move_t_c_p_action, HoldsWhileItIsPausedAndGoesOnAfterwards)
{
  Tested action;
  action.onPause();
  std::future<bool> result = std::async(std::launch::async, [&action] { return action.onRun(); });
  EXPECT_EQ(result.wait_for(std::chrono::seconds(2)), std::future_status::timeout);
  action.onResume();
  EXPECT_EQ(result.wait_for(std::chrono::seconds(30)), std::future_status::ready);
}

TEST(move_t_c_p_action, CanBeStoppedWhileItIsPaused)
{
  Tested action;
  action.onPause();
  std::future<bool> result = std::async(std::launch::async, [&action] { return action.onRun(); });
  action.stopAction();
  EXPECT_EQ(result.wait_for(std::chrono::seconds(5)), std::future_status::ready);
}
