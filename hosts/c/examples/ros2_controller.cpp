// A controller for ros2_control that uses aforce.h. It was never compiled, as this repository does not build with ROS.
// `Model` is a class of yours: pose, Jacobian, mass matrix, gravity and Coriolis torques of the arm.

#include <aforce.h>

#include <controller_interface/controller_interface.hpp>
#include <pluginlib/class_list_macros.hpp>
#include <realtime_tools/realtime_buffer.hpp>
#include <std_msgs/msg/float64_multi_array.hpp>

using controller_interface::CallbackReturn;
using controller_interface::InterfaceConfiguration;
using controller_interface::interface_configuration_type;

class AforceController : public controller_interface::ControllerInterface {
    AforceHost host_{};      // zeroed, never copied
    Model model_;               // yours: Pinocchio, KDL, the arm's own
    rclcpp::Subscription<std_msgs::msg::Float64MultiArray>::SharedPtr actions_;
    realtime_tools::RealtimeBuffer<std::vector<double>> latest_;
    unsigned taken_ = 0;
    std::atomic<unsigned> received_{0};
    double tau_[7] = {};

public:
    ~AforceController() override { aforce_drop(&host_); }

    CallbackReturn on_init() override {
        auto_declare<std::string>("setup", "");   // the TOML text itself, not a path
        return CallbackReturn::SUCCESS;
    }

    CallbackReturn on_configure(const rclcpp_lifecycle::State &) override {
        if (aforce_abi_version() != AFORCE_ABI_VERSION) return CallbackReturn::ERROR;
        char why[256] = "";
        aforce_drop(&host_);
        auto setup = get_node()->get_parameter("setup").as_string();
        if (aforce_init(&host_, setup.c_str(), why, sizeof why) != AFORCE_RESULT_OK) {
            RCLCPP_ERROR(get_node()->get_logger(), "setup: %s", why);
            return CallbackReturn::ERROR;
        }
        actions_ = get_node()->create_subscription<std_msgs::msg::Float64MultiArray>(
            "~/action", 1, [this](const std_msgs::msg::Float64MultiArray &message) {
                latest_.writeFromNonRT(message.data);
                received_++;
            });
        return CallbackReturn::SUCCESS;
    }

    InterfaceConfiguration command_interface_configuration() const override { return joints({"effort"}); }
    InterfaceConfiguration state_interface_configuration() const override { return joints({"position", "velocity"}); }

    CallbackReturn on_activate(const rclcpp_lifecycle::State &) override {
        AforceState state = read();
        // The torque commanded so far, from which the limits on its rate count. If the law compensates gravity, this is the gravity torque,
        // not the last torque of an earlier activation. If the arm itself does (interface.gravity = "arm"), it is 0.
        for (int i = 0; i < 7; i++) state.tau[i] = tau_[i] = state.gravity[i];
        taken_ = received_;             // actions from before the activation do not count
        double pose[16];
        model_.pose(state.q, pose);     // if the arm reports its own pose, put that into state.pose: aforce_start compares the two
        char why[256] = "";
        if (aforce_start(&host_, &state, pose, why, sizeof why) == AFORCE_RESULT_OK) return CallbackReturn::SUCCESS;
        RCLCPP_ERROR(get_node()->get_logger(), "refused: %s", why);
        return CallbackReturn::ERROR;
    }

    controller_interface::return_type update(const rclcpp::Time &, const rclcpp::Duration &period) override {
        if (unsigned received = received_; received != taken_) {
            taken_ = received;
            const auto &action = *latest_.readFromRT();
            aforce_set_goal(&host_, action.data(), action.size());
        }
        AforceState state = read();
        AforceCommand command;
        if (aforce_update(&host_, &state, period.seconds(), &command) != AFORCE_RESULT_OK)
            return controller_interface::return_type::ERROR;
        for (int i = 0; i < 7; i++) command_interfaces_[i].set_value(tau_[i] = command.tau[i]);
        if (command.fault)
            RCLCPP_ERROR_THROTTLE(get_node()->get_logger(), *get_node()->get_clock(), 1000, "%s",
                                  aforce_fault_text(command.fault));
        return controller_interface::return_type::OK;   // after a fault the host still gives a torque, which holds the posture ever more softly
    }

private:
    AforceState read() {
        AforceState state{};
        for (int i = 0; i < 7; i++) {
            state.q[i] = state_interfaces_[2 * i].get_value();
            state.qd[i] = state_interfaces_[2 * i + 1].get_value();
            state.tau[i] = tau_[i];
        }
        model_.pose(state.q, state.pose);               // 4 x 4, column-major
        model_.jacobian(state.q, state.jacobian);       // 6 x 7, column-major, linear first
        model_.mass(state.q, state.mass);
        model_.gravity(state.q, state.gravity);
        model_.coriolis(state.q, state.qd, state.coriolis);
        return state;                                   // wrench: from a sensor, or wrench.observed in the setup
    }

    InterfaceConfiguration joints(const std::vector<std::string> &kinds) const {
        InterfaceConfiguration config{interface_configuration_type::INDIVIDUAL, {}};
        for (int joint = 1; joint <= 7; joint++)
            for (const auto &kind : kinds) config.names.push_back("joint" + std::to_string(joint) + "/" + kind);
        return config;
    }
};

PLUGINLIB_EXPORT_CLASS(AforceController, controller_interface::ControllerInterface)
