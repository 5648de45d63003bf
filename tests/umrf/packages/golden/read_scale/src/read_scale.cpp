#include "read_scale/temoto_action.hpp"

namespace read_scale_action
{

/**
 * Reads a scale.
 */
class ReadScale : public TemotoAction
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

    // In place of this: short steps, and proceed() between them.
    for (int step = 0; step < 10 && actionOk(); ++step)
    {
      if (!proceed(std::chrono::milliseconds(100)))
      {
        return false;  // stopped
      }
    }

    // params_out.weight is a double
    // params_out.unit is a std::string
    // params_out.stable is a bool
    // params_out.samples is a std::vector<double>
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
  return boost::shared_ptr<::ActionBase>(new ReadScale());
}

}  // namespace read_scale_action

BOOST_DLL_ALIAS(read_scale_action::factory, ReadScale)
