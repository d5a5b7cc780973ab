"""Commands for many cars: cars, cars blink, cars name, cars stop, cars go."""

from collections.abc import Callable
from typing import Annotated

import typer

from motorcade.cli.options import CarList, JsonInPipes, OptionalFile, Search, Seconds, translated

app = typer.Typer()
Names = Annotated[list[str], typer.Argument(metavar="NAME…")]


@app.callback(invoke_without_command=True)
def _cars(
    context: typer.Context,
    car_list: CarList = None,
    keys: OptionalFile = None,
    seconds: Seconds = 4.0,
    as_json: JsonInPipes = False,
) -> None:
    if context.invoked_subcommand is not None:
        return
    import asyncio

    from motorcade.cli.fleet import print_cars, show_cars

    asyncio.run((print_cars if as_json else show_cars)(Search(car_list, keys, seconds)))


@app.command("blink")
def _blink(names: Names, car_list: CarList = None, keys: OptionalFile = None, seconds: Seconds = 4.0) -> None:
    import asyncio

    from motorcade.cli.fleet import act
    from motorcade.words.request import BLINK

    asyncio.run(act(Search(car_list, keys, seconds), names, BLINK))
    print(translated("cars-blink", names=", ".join(names)))


@app.command("name")
def _name(
    port: Annotated[str, typer.Argument(metavar="PORT")],
    name: Annotated[str, typer.Argument(metavar="NAME")],
    car_list: CarList = None,
    keys: OptionalFile = None,
    seconds: Seconds = 4.0,
) -> None:
    import asyncio

    from motorcade.cli.fleet import act
    from motorcade.fleet.places import check_name
    from motorcade.words.request import NAME

    check_name(name)
    asyncio.run(act(Search(car_list, keys, seconds), [port], NAME, name))
    print(translated("car-named", port=port, name=name))


def _ordering(kind: str) -> Callable[..., None]:
    def order_all(
        car_list: CarList = None,
        keys: OptionalFile = None,
        seconds: Seconds = 4.0,
        as_json: JsonInPipes = False,
    ) -> None:
        import asyncio

        from motorcade.cli.fleet import order

        asyncio.run(order(kind, Search(car_list, keys, seconds), as_json))

    return order_all


for _kind in ("stop", "go"):
    app.command(_kind)(_ordering(_kind))
