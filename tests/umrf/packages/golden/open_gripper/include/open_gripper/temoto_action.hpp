#pragma once

#include "temoto_action_engine/action_base.h"
#include "temoto_action_engine/util/error.hpp"
#include "temoto_action_engine/util/logging.hpp"

#include <boost/any.hpp>
#include <boost/config.hpp>
#include <boost/dll/alias.hpp>
#include <boost/shared_ptr.hpp>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <type_traits>
#include <vector>

namespace open_gripper_action
{

/**
 * What lies between the engine and the action: parameters, pause and stop.
 *
 * The engine calls onPause, onResume and onStop from threads of its own while onRun runs.
 */
class TemotoAction : public ::ActionBase
{
public:
  const std::string& getName()
  {
    return getUmrfNodeConst().getFullName();
  }

  void updateParameters(const ::ActionParameters&) override
  {
    // The engine hands in new values before each onRun; none change while it runs.
  }

  void onPause() override
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    paused_ = true;
  }

  void onResume() override
  {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      paused_ = false;
    }
    changed_.notify_all();
  }

  void onStop() override
  {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      paused_ = false;
    }
    changed_.notify_all();
  }

  /**
   * Takes `rest`, and as long as the action is paused; returns at once when it is stopped.
   *
   * @return whether the action may go on, as actionOk() says
   */
  bool proceed(std::chrono::milliseconds rest = std::chrono::milliseconds(0))
  {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait_for(lock, rest, [this] { return !actionOk(); });
    changed_.wait(lock, [this] { return !paused_ || !actionOk(); });
    return actionOk();
  }

private:
  void getInputParameters() override
  {
  }

  void setOutputParameters() override
  {
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool paused_ = false;
};

}  // namespace open_gripper_action
