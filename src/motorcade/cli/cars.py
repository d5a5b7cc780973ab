"""Commands for many cars: cars, cars blink, cars name, cars stop, cars go."""

from collections.abc import Callable
from typing import Annotated

import typer

from motorcade.cli.options import CarList, Json, Language, OptionalFile, Search, Seconds, translated, wants_json

app = typer.Typer()
Names = Annotated[list[str], typer.Argument(metavar="NAME…")]


@app.callback(invoke_without_command=True)
def _cars(
    context: typer.Context,
    car_list: CarList = None,
    keys: OptionalFile = None,
    seconds: Seconds = 4.0,
    language: Language = "",
    as_json: Json = False,
) -> None:
    if context.invoked_subcommand is not None:
        return
    search = Search(car_list, keys, seconds)
    from motorcade.cli import fleet

    (fleet.print_cars if wants_json(as_json) else fleet.show_cars)(search)


@app.command("blink")
def _blink(
    names: Names, car_list: CarList = None, keys: OptionalFile = None, seconds: Seconds = 4.0, language: Language = ""
) -> None:
    from motorcade.cli.fleet import act
    from motorcade.words.request import BLINK

    act(Search(car_list, keys, seconds), names, BLINK)
    print(translated("cars-blink", names=", ".join(names)))


@app.command("name")
def _name(
    port: Annotated[str, typer.Argument(metavar="PORT")],
    name: Annotated[str, typer.Argument(metavar="NAME")],
    car_list: CarList = None,
    keys: OptionalFile = None,
    seconds: Seconds = 4.0,
    language: Language = "",
) -> None:
    from motorcade.cli.fleet import act
    from motorcade.fleet.places import check_name
    from motorcade.words.request import NAME

    check_name(name)
    act(Search(car_list, keys, seconds), [port], NAME, name)
    print(translated("car-named", port=port, name=name))


def _ordering(kind: str) -> Callable[..., None]:
    def order_all(
        car_list: CarList = None,
        keys: OptionalFile = None,
        seconds: Seconds = 4.0,
        language: Language = "",
        as_json: Json = False,
    ) -> None:
        from motorcade.cli.fleet import order

        order(kind, Search(car_list, keys, seconds), as_json)

    return order_all


for _kind in ("stop", "go"):
    app.command(_kind)(_ordering(_kind))
