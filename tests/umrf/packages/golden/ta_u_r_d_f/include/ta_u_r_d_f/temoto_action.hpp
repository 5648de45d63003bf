#pragma once

#include "temoto_action_engine/action_base.h"
#include "temoto_action_engine/util/error.hpp"
#include "temoto_action_engine/util/logging.hpp"

#include "ta_u_r_d_f/input_parameters.hpp"
#include "ta_u_r_d_f/output_parameters.hpp"

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

namespace ta_u_r_d_f_action
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
  output_parameters_t params_out;

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
    const ::ActionParameters& parameters = getUmrfNodeConst().getInputParameters();
    params_in.class_ = given<std::vector<std::string>>(parameters, "class");
    params_in.NULL_ = given<std::vector<bool>>(parameters, "NULL");
    params_in.survey_type = given<std::string>(parameters, "survey type");
    params_in.robot = given<boost::any>(parameters, "robot");
  }

  void setOutputParameters() override
  {
    give("robot", "urdf::Model", params_out.robot);
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool paused_ = false;
};

}  // namespace ta_u_r_d_f_action
