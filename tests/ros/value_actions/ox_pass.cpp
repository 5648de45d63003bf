// Takes a value of each native type, writes down which, and gives each of them on, changed.
#include "temoto_action_engine/action_base.h"

#include <boost/config.hpp>
#include <boost/dll/alias.hpp>
#include <boost/shared_ptr.hpp>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <unistd.h>
#include <vector>

struct OxPass : ActionBase
{
  std::atomic<bool> stopped{false};
  nlohmann::json got = nlohmann::json::object();
  nlohmann::json gave = nlohmann::json::object();
  double delay = 0;
  std::string result;
  bool gives = true;

  void truth(const std::string& event, const nlohmann::json& values)
  {
    const char* file = std::getenv("ENGINE_TRUTH");
    if (file == nullptr)
    {
      return;
    }
    const auto now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch());
    std::string line = nlohmann::json{{"at", now.count()},
                                      {"node", getUmrfNodeConst().getFullName()},
                                      {"event", event},
                                      {"values", values}}
                           .dump() +
                       "\n";
    const int target = open(file, O_WRONLY | O_APPEND | O_CREAT, 0644);
    (void)!write(target, line.data(), line.size());
    close(target);
  }

  template <class T>
  T take(const std::string& name, bool notes = true)
  {
    const auto& inputs = getUmrfNodeConst().getInputParameters();
    if (!inputs.hasParameter(name) || inputs.getParameter(name).getDataSize() == 0)
    {
      return T();
    }
    const T value = inputs.getParameterData<T>(name);
    if (notes)
    {
      got[name] = value;
    }
    return value;
  }

  template <class T>
  void give(const std::string& name, const std::string& type, const T& value)
  {
    gave[name] = value;
    getUmrfNode().getOutputParametersNc().setParameter(name, type, boost::any(value));
  }

  std::string text;
  double count = 0;
  bool flag = false;
  std::vector<std::string> texts;
  std::vector<double> counts;
  std::vector<bool> flags;

  void updateParameters(const ActionParameters&) override {}

  void getInputParameters() override
  {
    delay = take<double>("delay", false);
    result = take<std::string>("result", false);
    gives = !take<bool>("silent", false);
    text = take<std::string>("text");
    count = take<double>("count");
    flag = take<bool>("flag");
    texts = take<std::vector<std::string>>("texts");
    counts = take<std::vector<double>>("counts");
    flags = take<std::vector<bool>>("flags");
  }

  void setOutputParameters() override
  {
    if (gives)
    {
      give("text", "string", text + "\xc3\xa4\"");
      give("count", "number", count * 1.5 + 0.1);
      give("flag", "bool", !flag);
      texts.push_back(std::to_string(texts.size()));
      give("texts", "strings", texts);
      counts.push_back(count);
      give("counts", "numbers", counts);
      flags.push_back(flag);
      give("flags", "bools", flags);
    }
    truth("gave", gave);
  }

  void onStop() override { stopped = true; }

  bool onRun() override
  {
    truth("got", got);
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(delay);
    while (!stopped && std::chrono::steady_clock::now() < end)
    {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    if (result == "on_error")
    {
      throw std::runtime_error("as it was told to");
    }
    return result != "on_false";
  }
};

boost::shared_ptr<ActionBase> factory() { return boost::shared_ptr<OxPass>(new OxPass()); }
BOOST_DLL_ALIAS(factory, OxPass)
