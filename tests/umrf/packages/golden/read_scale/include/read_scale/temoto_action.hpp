#pragma once

#include "temoto_action_engine/action_base.h"
#include "temoto_action_engine/util/error.hpp"
#include "temoto_action_engine/util/logging.hpp"

#include "read_scale/output_parameters.hpp"

#include <boost/any.hpp>
#include <boost/config.hpp>
#include <boost/dll/alias.hpp>
#include <boost/shared_ptr.hpp>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace read_scale_action
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

  output_parameters_t params_out;

private:
  /// Hands out an output, also an empty one, since a graph that waits for one that never comes has no end.
  /// One that the engine does not take is an error of an action that was not stopped: engines may abort
  /// where it is waited for.
  void give(const std::string& name, const std::string& type, const boost::any& value)
  {
    if (getUmrfNode().getOutputParametersNc().setParameter(name, type, value))
    {
      return;
    }
    writeLog("The engine did not take the output " + name + ".");
    if (actionOk())
    {
      throw std::runtime_error("The engine did not take the output " + name + ".");
    }
  }

  void getInputParameters() override
  {
  }

  void setOutputParameters() override
  {
    give("weight", "number", boost::any(params_out.weight));
    give("unit", "string", boost::any(params_out.unit));
    give("stable", "bool", boost::any(params_out.stable));
    give("samples", "numbers", boost::any(params_out.samples));
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool paused_ = false;
};

}  // namespace read_scale_action
