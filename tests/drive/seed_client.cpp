// A client as the second seed describes it: an int, shifts, and send() of its four bytes.
// Usage: seed_client PORT native|network; each line "angle direction speed" of standard input is one command.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

struct CarVector {
    int angle;
    bool direction;
    int speed;
};

int createCmd(struct CarVector carVector) {
    int code = 1;
    return ((code << 17) | (carVector.angle << 9) | (carVector.direction << 8) | carVector.speed) << 11;
}

int main(int argc, char **argv) {
    if (argc != 3) return 2;
    bool network = std::strcmp(argv[2], "network") == 0;
    int car = socket(AF_INET, SOCK_STREAM, 0);
    struct sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(std::atoi(argv[1]));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(car, (struct sockaddr *)&address, sizeof address) != 0) return 3;
    int angle, direction, speed;
    while (std::scanf("%d %d %d", &angle, &direction, &speed) == 3) {
        int cmd = createCmd({angle, direction != 0, speed});
        if (network) cmd = htonl(cmd);
        if (send(car, &cmd, sizeof cmd, 0) != sizeof cmd) return 4;
    }
    close(car);
    return 0;
}
