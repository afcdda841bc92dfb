// A robot that uses eProsima Fast DDS, the default middleware of ROS 2: commands on stdin, what it receives on stdout.
//   robot DOMAIN [NAMESPACE]
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

#include "rosPubSubTypes.h"

using namespace eprosima::fastdds::dds;
using builtin_interfaces::msg::dds_::Time_;

static std::mutex printing;

static void print(const std::string& line) {
    std::lock_guard<std::mutex> lock(printing);
    std::cout << line << std::endl;
}

struct Profile {
    bool reliable;
    bool latched;
};
static const Profile SENSOR{false, false}, RELIABLE{true, false}, LATCHED{true, true};

template <class Message>
class Listener : public DataReaderListener {
public:
    explicit Listener(std::function<void(const Message&)> take) : take_(std::move(take)) {}
    void on_data_available(DataReader* reader) override {
        Message message;
        SampleInfo info;
        while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
            if (info.valid_data) take_(message);
        }
    }

private:
    std::function<void(const Message&)> take_;
};

class Robot {
public:
    Robot(unsigned domain, const std::string& space) : space_(space) {
        DomainParticipantQos qos;
        auto loopback = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
        loopback->interfaceWhiteList.push_back("127.0.0.1");
        qos.transport().user_transports.push_back(loopback);
        qos.transport().use_builtin_transports = false;
        participant_ = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
        publisher_ = participant_->create_publisher(PUBLISHER_QOS_DEFAULT);
        subscriber_ = participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
    }

    template <class Type>
    DataWriter* writer(const std::string& name, Profile profile) {
        DataWriterQos qos;
        qos.reliability().kind = profile.reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
        qos.durability().kind = profile.latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
        qos.history().depth = 10;
        qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        qos.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;
        return publisher_->create_datawriter(topic<Type>(name), qos);
    }

    template <class Type, class Message>
    void reader(const std::string& name, Profile profile, std::function<void(const Message&)> take) {
        DataReaderQos qos;
        qos.reliability().kind = profile.reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
        qos.durability().kind = profile.latched ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
        qos.history().depth = 10;
        qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
        subscriber_->create_datareader(topic<Type>(name), qos, new Listener<Message>(std::move(take)));
    }

private:
    template <class Type>
    Topic* topic(const std::string& name) {
        TypeSupport type(new Type());
        type.register_type(participant_);
        const std::string whole = "rt" + (name[0] == '/' ? name : space_ + "/" + name);
        if (auto* known = participant_->lookup_topicdescription(whole)) return dynamic_cast<Topic*>(known);
        return participant_->create_topic(whole, type.get_type_name(), TOPIC_QOS_DEFAULT);
    }

    std::string space_;
    DomainParticipant* participant_;
    Publisher* publisher_;
    Subscriber* subscriber_;
};

static Time_ time_of(std::istream& words) {
    long sec;
    unsigned long nanosec;
    words >> sec >> nanosec;
    Time_ stamp;
    stamp.sec(sec);
    stamp.nanosec(nanosec);
    return stamp;
}

namespace g = geometry_msgs::msg::dds_;
using Posed = g::PoseWithCovarianceStamped_;

// What this robot and an AMCL would publish besides its own topics.
struct Others {
    DataWriter *global_mounts, *moving, *amcl;
};

static g::TransformStamped_ transform(const std::string& parent, const std::string& child, std::istream& words) {
    double x, y, theta;
    words >> x >> y >> theta;
    g::TransformStamped_ one;
    one.header().frame_id(parent);
    one.child_frame_id(child);
    one.transform().translation().x(x);
    one.transform().translation().y(y);
    one.transform().rotation().z(std::sin(0.5 * theta));
    one.transform().rotation().w(std::cos(0.5 * theta));
    return one;
}

static void publish_other(const Others& others, const std::string& command, std::istream& words) {
    if (command == "global_mount" || command == "moving_mount") {
        const bool moving = command == "moving_mount";
        std::string prefix;
        if (!moving) words >> prefix;
        const Time_ stamp = moving ? time_of(words) : Time_();
        auto one = transform(prefix + "base_link", prefix + "laser", words);
        one.header().stamp(stamp);
        tf2_msgs::msg::dds_::TFMessage_ message;
        message.transforms().push_back(one);
        (moving ? others.moving : others.global_mounts)->write(&message);
    } else if (command == "amcl") {
        Posed message;
        message.header().stamp(time_of(words));
        message.header().frame_id("map");
        double x, y, theta;
        words >> x >> y >> theta;
        message.pose().pose().position().x(x);
        message.pose().pose().position().y(y);
        message.pose().pose().orientation().z(std::sin(0.5 * theta));
        message.pose().pose().orientation().w(std::cos(0.5 * theta));
        for (int k : {0, 7, 35}) message.pose().covariance()[k] = 0.01;
        others.amcl->write(&message);
    }
}

static std::function<void(const Posed&)> printing_pose(const std::string& name) {
    return [name](const Posed& message) {
        std::ostringstream line;
        const auto& pose = message.pose().pose();
        line << name << ' ' << message.header().stamp().sec() << ' ' << message.header().stamp().nanosec() << ' '
             << pose.position().x() << ' ' << pose.position().y() << ' '
             << 2.0 * std::atan2(pose.orientation().z(), pose.orientation().w()) << ' ' << message.header().frame_id();
        print(line.str());
    };
}

static void subscribe_others(Robot& robot) {
    using Markers = visualization_msgs::msg::dds_::MarkerArray_;
    for (const char* name : {"linefix/map_markers", "linefix/markers"}) {
        robot.reader<visualization_msgs::msg::dds_::MarkerArray_PubSubType, Markers>(
            name, LATCHED, [](const Markers& message) {
                for (const auto& one : message.markers()) {
                    print("marker " + one.ns() + ' ' + std::to_string(one.points().size()));
                }
            });
    }
    robot.reader<g::PoseWithCovarianceStamped_PubSubType, Posed>(
        "linefix/agreed_pose", RELIABLE, printing_pose("agreed"));
    using Text = std_msgs::msg::dds_::String_;
    robot.reader<std_msgs::msg::dds_::String_PubSubType, Text>(
        "linefix/map_id", LATCHED, [](const Text& message) { print("map_id " + message.data()); });
}

int main(int argc, char** argv) {
    const std::string space = argc > 2 ? argv[2] : "";
    Robot robot(std::stoul(argv[1]), space);
    auto* scans = robot.writer<sensor_msgs::msg::dds_::LaserScan_PubSubType>("scan", SENSOR);
    auto* odometry = robot.writer<nav_msgs::msg::dds_::Odometry_PubSubType>("odom", RELIABLE);
    auto* mounts = robot.writer<tf2_msgs::msg::dds_::TFMessage_PubSubType>("tf_static", LATCHED);
    auto* maps = robot.writer<nav_msgs::msg::dds_::OccupancyGrid_PubSubType>("map", LATCHED);
    auto* requests = robot.writer<std_msgs::msg::dds_::Empty_PubSubType>("linefix/locate", RELIABLE);
    const Others others{
        robot.writer<tf2_msgs::msg::dds_::TFMessage_PubSubType>("/tf_static", LATCHED),
        robot.writer<tf2_msgs::msg::dds_::TFMessage_PubSubType>(space.empty() ? "/tf" : "tf", RELIABLE),
        robot.writer<g::PoseWithCovarianceStamped_PubSubType>("amcl_pose", LATCHED),
    };
    print("ready");  // before any reader: what is latched comes at once, and counts
    subscribe_others(robot);
    robot.reader<g::PoseWithCovarianceStamped_PubSubType, Posed>("initialpose", RELIABLE, printing_pose("initialpose"));
    robot.reader<g::PoseWithCovarianceStamped_PubSubType, Posed>("linefix/pose", RELIABLE, printing_pose("pose"));
    robot.reader<tf2_msgs::msg::dds_::TFMessage_PubSubType, tf2_msgs::msg::dds_::TFMessage_>(
        space.empty() ? "/tf" : "tf", RELIABLE, [](const tf2_msgs::msg::dds_::TFMessage_& message) {
            for (const auto& one : message.transforms()) {
                print("tf " + one.header().frame_id() + ' ' + one.child_frame_id());
            }
        });
    using Status = diagnostic_msgs::msg::dds_::DiagnosticStatus_;
    robot.reader<diagnostic_msgs::msg::dds_::DiagnosticStatus_PubSubType, Status>(
        "linefix/status", LATCHED,
        [](const Status& message) { print("status " + std::to_string(message.level()) + ' ' + message.message()); });
    using Diagnostics = diagnostic_msgs::msg::dds_::DiagnosticArray_;
    robot.reader<diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType, Diagnostics>(
        "/diagnostics", RELIABLE, [](const Diagnostics& message) {
            for (const auto& one : message.status()) print("diagnostics " + one.name() + ": " + one.message());
        });

    std::string text;
    while (std::getline(std::cin, text)) {
        std::istringstream words(text);
        std::string command;
        words >> command;
        if (command == "mount") {
            tf2_msgs::msg::dds_::TFMessage_ message;
            message.transforms().push_back(transform("base_link", "laser", words));
            mounts->write(&message);
        } else if (command == "odom") {
            nav_msgs::msg::dds_::Odometry_ message;
            message.header().stamp(time_of(words));
            message.header().frame_id("odom");
            message.child_frame_id("base_link");
            double x, y, theta;
            words >> x >> y >> theta;
            message.pose().pose().position().x(x);
            message.pose().pose().position().y(y);
            message.pose().pose().orientation().z(std::sin(0.5 * theta));
            message.pose().pose().orientation().w(std::cos(0.5 * theta));
            odometry->write(&message);
        } else if (command == "scan") {
            sensor_msgs::msg::dds_::LaserScan_ message;
            message.header().stamp(time_of(words));
            message.header().frame_id("laser");
            float first, step, range;
            words >> first >> step;
            while (words >> range) message.ranges().push_back(range);
            message.angle_min(first);
            message.angle_max(first + step * (message.ranges().size() - 1));
            message.angle_increment(step);
            message.range_min(0.05f);
            message.range_max(30.0f);
            scans->write(&message);
        } else if (command == "map") {
            nav_msgs::msg::dds_::OccupancyGrid_ message;
            double resolution, x, y;
            unsigned long width, height;
            int cell;
            words >> resolution >> width >> height >> x >> y;
            message.header().frame_id("map");
            message.info().resolution(resolution);
            message.info().width(width);
            message.info().height(height);
            message.info().origin().position().x(x);
            message.info().origin().position().y(y);
            message.info().origin().orientation().w(1.0);
            while (words >> cell) message.data().push_back(static_cast<uint8_t>(cell));
            maps->write(&message);
        } else if (command == "locate") {
            std_msgs::msg::dds_::Empty_ message;
            requests->write(&message);
        } else {
            publish_other(others, command, words);
        }
    }
    std::_Exit(0);
}
