#include "move_t_c_p/temoto_action.hpp"

namespace move_t_c_p_action
{

/**
 * Moves the tool to a pose, as fast as is allowed.
 * Keeps its orientation.
 */
class MoveTCP : public TemotoAction
{
public:
  void onInit() override
  {
    // Called once, before the first onRun.
  }

  /**
   * The work. It ends within 5 s of a stop, or the engine calls the action failed; it holds while it
   * is paused; and it takes some time, since actions that take none lock up an engine that repeats them.
   *
   * @return true or false, after which the graph may go on differently; an exception is `on_error`
   */
  bool onRun() override
  {
    TEMOTO_PRINT_OF("Running", getName());
    // params_in.pose.position.x is a double
    // params_in.pose.position.y is a double
    // params_in.pose.position.z is a double
    // params_in.pose.orientation.yaw is a double
    // params_in.position.frame is a std::string
    // params_in.speed is a double

    // In place of this: short steps, and proceed() between them.
    for (int step = 0; step < 10 && actionOk(); ++step)
    {
      if (!proceed(std::chrono::milliseconds(100)))
      {
        return false;  // stopped
      }
    }

    return actionOk();
  }

  void onPause() override
  {
    TemotoAction::onPause();  // proceed() waits from here on
    // What moves by itself has to be held here.
  }

  void onResume() override
  {
    // What was held goes on here.
    TemotoAction::onResume();
  }

  void onStop() override
  {
    TemotoAction::onStop();  // actionOk() is false already, and proceed() returns
    // What moves by itself has to be stopped here.
  }
};

boost::shared_ptr<::ActionBase> factory()
{
  return boost::shared_ptr<::ActionBase>(new MoveTCP());
}

}  // namespace move_t_c_p_action

BOOST_DLL_ALIAS(move_t_c_p_action::factory, MoveTCP)
