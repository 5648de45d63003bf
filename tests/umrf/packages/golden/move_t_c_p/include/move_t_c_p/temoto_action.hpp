#pragma once

#include "temoto_action_engine/action_base.h"
#include "temoto_action_engine/util/error.hpp"
#include "temoto_action_engine/util/logging.hpp"

#include "move_t_c_p/input_parameters.hpp"

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

namespace move_t_c_p_action
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

  input_parameters_t params_in;

private:
  /// The value of an input; an empty one where the engine has none.
  template <class T>
  static T given(const ::ActionParameters& parameters, const std::string& name)
  {
    if (!parameters.hasParameter(name) || parameters.getParameter(name).getDataSize() == 0)
    {
      return T();
    }
    if constexpr (std::is_same_v<T, boost::any>)
    {
      return parameters.getParameter(name).getData();
    }
    else
    {
      return parameters.getParameterData<T>(name);
    }
  }

  void getInputParameters() override
  {
    const ::ActionParameters& parameters = getUmrfNodeConst().getInputParameters();
    params_in.pose.position.x = given<double>(parameters, "pose::position::x");
    params_in.pose.position.y = given<double>(parameters, "pose::position::y");
    params_in.pose.position.z = given<double>(parameters, "pose::position::z");
    params_in.pose.orientation.yaw = given<double>(parameters, "pose::orientation::yaw");
    params_in.position.frame = given<std::string>(parameters, "position::frame");
    params_in.speed = given<double>(parameters, "speed");
  }

  void setOutputParameters() override
  {
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool paused_ = false;
};

}  // namespace move_t_c_p_action
