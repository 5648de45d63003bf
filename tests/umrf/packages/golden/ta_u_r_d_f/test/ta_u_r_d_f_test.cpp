#include "../src/ta_u_r_d_f.cpp"

#include <gtest/gtest.h>

#include <chrono>
#include <future>

using Tested = ta_u_r_d_f_action::TaURDF;

TEST(ta_u_r_d_f_action, EndsSoonAfterAStop)
{
  Tested action;
  std::future<bool> result = std::async(std::launch::async, [&action] { return action.onRun(); });
  action.stopAction();
  EXPECT_EQ(result.wait_for(std::chrono::seconds(5)), std::future_status::ready);
}

TEST(ta_u_r_d_f_action, HoldsWhileItIsPausedAndGoesOnAfterwards)
{
  Tested action;
  action.onPause();
  std::future<bool> result = std::async(std::launch::async, [&action] { return action.onRun(); });
  EXPECT_EQ(result.wait_for(std::chrono::seconds(2)), std::future_status::timeout);
  action.onResume();
  EXPECT_EQ(result.wait_for(std::chrono::seconds(30)), std::future_status::ready);
}

TEST(ta_u_r_d_f_action, CanBeStoppedWhileItIsPaused)
{
  Tested action;
  action.onPause();
  std::future<bool> result = std::async(std::launch::async, [&action] { return action.onRun(); });
  action.stopAction();
  EXPECT_EQ(result.wait_for(std::chrono::seconds(5)), std::future_status::ready);
}
